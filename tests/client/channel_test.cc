#include "client/channel.h"

#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace stance {
namespace {

TEST(FromGrpcStatusTest, KeepsCodeAndTextAndAddsTheDetails) {
  EXPECT_TRUE(FromGrpcStatus(grpc::Status::OK).ok());
  google::rpc::Status details;
  google::rpc::BadRequest bad_request;
  bad_request.add_field_violations()->set_field("source.arrays.indices");
  details.add_details()->PackFrom(bad_request);
  google::rpc::ErrorInfo info;
  info.set_reason("INVALID_MESH");
  details.add_details()->PackFrom(info);
  const absl::Status status = FromGrpcStatus(grpc::Status(
      grpc::StatusCode::INVALID_ARGUMENT, "index 9 is out of range", details.SerializeAsString()));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(std::string(status.message()), "source.arrays.indices: index 9 is out of range [INVALID_MESH]");
}

TEST(FromGrpcStatusTest, DetailsThatAreNotAStatusAreIgnored) {
  const absl::Status status =
      FromGrpcStatus(grpc::Status(grpc::StatusCode::UNAVAILABLE, "full", "\xff\xff not a message"));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(std::string(status.message()), "full");
}

TEST(ServiceConfigTest, IsJsonWithRetriesOnUnavailableOnly) {
  const auto json = nlohmann::json::parse(ServiceConfigJson({}));
  const auto& method = json["methodConfig"][0];
  EXPECT_EQ(method["retryPolicy"]["maxAttempts"], 4);
  EXPECT_EQ(method["retryPolicy"]["retryableStatusCodes"], nlohmann::json({"UNAVAILABLE"}));
  EXPECT_TRUE(json["loadBalancingConfig"][0].contains("round_robin"));
  ClientOptions once;
  once.max_attempts = 1;
  EXPECT_FALSE(nlohmann::json::parse(ServiceConfigJson(once))["methodConfig"][0].contains("retryPolicy"));
}

}  // namespace
}  // namespace stance
