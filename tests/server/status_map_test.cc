#include "server/status_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace stance {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

google::rpc::Status Details(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  return details;
}

// The one detail of that type; a default message, with a failure, if there isn't exactly one.
template <typename Message>
Message Detail(const grpc::Status& status) {
  Message message;
  int found = 0;
  const google::rpc::Status details = Details(status);
  for (const auto& detail : details.details()) {
    if (detail.Is<Message>()) {
      EXPECT_TRUE(detail.UnpackTo(&message));
      ++found;
    }
  }
  EXPECT_EQ(found, 1);
  return message;
}

TEST(StatusMapTest, OkHasNoDetails) {
  const grpc::Status status = ToGrpcStatus(absl::OkStatus());
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(status.error_details(), "");
  EXPECT_EQ(ReasonOf(absl::OkStatus()), "");
}

struct CodePair {
  absl::StatusCode absl_code;
  grpc::StatusCode grpc_code;
  const char* reason;
};

class StatusMapCodeTest : public ::testing::TestWithParam<CodePair> {};

TEST_P(StatusMapCodeTest, KeepsCodeAndTextAndNamesAReason) {
  const grpc::Status status = ToGrpcStatus(absl::Status(GetParam().absl_code, "what happened"));
  EXPECT_EQ(status.error_code(), GetParam().grpc_code);
  EXPECT_EQ(status.error_message(), "what happened");
  EXPECT_EQ(Details(status).code(), static_cast<int>(GetParam().grpc_code));
  EXPECT_EQ(Details(status).message(), "what happened");
  const auto info = Detail<google::rpc::ErrorInfo>(status);
  EXPECT_EQ(info.reason(), GetParam().reason);
  EXPECT_EQ(info.domain(), "stance");
}

INSTANTIATE_TEST_SUITE_P(
    Codes, StatusMapCodeTest,
    ::testing::Values(
        CodePair{absl::StatusCode::kCancelled, grpc::CANCELLED, "CANCELLED"},
        CodePair{absl::StatusCode::kUnknown, grpc::UNKNOWN, "UNKNOWN"},
        CodePair{absl::StatusCode::kInvalidArgument, grpc::INVALID_ARGUMENT, "INVALID_ARGUMENT"},
        CodePair{absl::StatusCode::kDeadlineExceeded, grpc::DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED"},
        CodePair{absl::StatusCode::kNotFound, grpc::NOT_FOUND, "NOT_FOUND"},
        CodePair{absl::StatusCode::kAlreadyExists, grpc::ALREADY_EXISTS, "ALREADY_EXISTS"},
        CodePair{absl::StatusCode::kPermissionDenied, grpc::PERMISSION_DENIED, "PERMISSION_DENIED"},
        CodePair{absl::StatusCode::kResourceExhausted, grpc::RESOURCE_EXHAUSTED, "RESOURCE_EXHAUSTED"},
        CodePair{absl::StatusCode::kFailedPrecondition, grpc::FAILED_PRECONDITION, "FAILED_PRECONDITION"},
        CodePair{absl::StatusCode::kAborted, grpc::ABORTED, "ABORTED"},
        CodePair{absl::StatusCode::kOutOfRange, grpc::OUT_OF_RANGE, "OUT_OF_RANGE"},
        CodePair{absl::StatusCode::kUnimplemented, grpc::UNIMPLEMENTED, "UNIMPLEMENTED"},
        CodePair{absl::StatusCode::kInternal, grpc::INTERNAL, "INTERNAL"},
        CodePair{absl::StatusCode::kUnavailable, grpc::UNAVAILABLE, "UNAVAILABLE"},
        CodePair{absl::StatusCode::kDataLoss, grpc::DATA_LOSS, "DATA_LOSS"},
        CodePair{absl::StatusCode::kUnauthenticated, grpc::UNAUTHENTICATED, "UNAUTHENTICATED"}));

TEST(StatusMapTest, AFieldErrorCarriesItsPath) {
  const absl::Status error =
      FieldError(absl::StatusCode::kInvalidArgument, "INVALID_MESH", "source.arrays.positions", "13 bytes");
  EXPECT_EQ(ReasonOf(error), "INVALID_MESH");
  const grpc::Status status = ToGrpcStatus(error);
  EXPECT_EQ(status.error_message(), "source.arrays.positions: 13 bytes");
  EXPECT_EQ(Detail<google::rpc::ErrorInfo>(status).reason(), "INVALID_MESH");
  const auto bad_request = Detail<google::rpc::BadRequest>(status);
  ASSERT_EQ(bad_request.field_violations_size(), 1);
  EXPECT_EQ(bad_request.field_violations(0).field(), "source.arrays.positions");
  EXPECT_EQ(bad_request.field_violations(0).description(), "13 bytes");
}

std::string FieldOf(const absl::Status& status) {
  return Detail<google::rpc::BadRequest>(ToGrpcStatus(status)).field_violations(0).field();
}

TEST(StatusMapTest, NameFieldFindsThePathInTheText) {
  const absl::Status inner = absl::InvalidArgumentError("arrays.positions: 13 bytes: too few");
  EXPECT_EQ(FieldOf(NameField(inner, "INVALID_MESH", "source")), "source.arrays.positions");
  EXPECT_EQ(FieldOf(NameField(inner, "INVALID_MESH", "")), "arrays.positions");
  const absl::Status sentence = absl::InvalidArgumentError("Bad header: no faces");
  EXPECT_EQ(FieldOf(NameField(sentence, "INVALID_MESH", "mesh")), "mesh");
  EXPECT_TRUE(NameField(absl::OkStatus(), "INVALID_MESH", "mesh").ok());
}

TEST(StatusMapTest, AnOverloadSaysWhenToRetry) {
  const absl::Status error = OverloadError("QUEUE_FULL", "full", milliseconds(1250));
  EXPECT_EQ(RetryPushback(error), milliseconds(1250));
  const grpc::Status status = ToGrpcStatus(error);
  EXPECT_EQ(status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(Detail<google::rpc::ErrorInfo>(status).reason(), "QUEUE_FULL");
  const auto retry = Detail<google::rpc::RetryInfo>(status);
  EXPECT_EQ(retry.retry_delay().seconds(), 1);
  EXPECT_EQ(retry.retry_delay().nanos(), 250'000'000);
  EXPECT_EQ(RetryPushback(absl::InternalError("x")), std::nullopt);
}

TEST(StatusMapTest, AQuotaSaysWhenToRetry) {
  const absl::Status error = QuotaError("CLIENT_QUOTA", "too many", milliseconds(250));
  EXPECT_EQ(RetryPushback(error), milliseconds(250));
  const grpc::Status status = ToGrpcStatus(error);
  EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_EQ(Detail<google::rpc::ErrorInfo>(status).reason(), "CLIENT_QUOTA");
}

TEST(StatusMapTest, MetadataOfAReasonTravels) {
  const absl::Status error = WithReason(absl::NotFoundError("x"), "MODEL_NOT_FOUND", {{"model", "m"}});
  EXPECT_EQ(Detail<google::rpc::ErrorInfo>(ToGrpcStatus(error)).metadata().at("model"), "m");
}

// What the caller's bytes put into a text must neither break the protobuf nor outgrow gRPC's 8 KiB of
// metadata.
TEST(StatusMapTest, TextIsPrintableAndBounded) {
  const std::string hostile =
      "file.content: line '" + std::string("\xff\x00\n", 3) + std::string(100'000, 'x');
  const grpc::Status status =
      ToGrpcStatus(NameField(absl::InvalidArgumentError(hostile), "INVALID_MESH", "source"));
  EXPECT_LT(status.error_message().size() + status.error_details().size(), 6000u);
  EXPECT_THAT(status.error_message(), HasSubstr("source.file.content: line '???x"));
  EXPECT_EQ(Detail<google::rpc::BadRequest>(status).field_violations(0).field(), "source.file.content");
}

}  // namespace
}  // namespace stance
