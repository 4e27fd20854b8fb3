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

TEST(CheckCredentialsTest, ATokenLeavesTheMachineWithTlsOnly) {
  ClientOptions options;
  options.token = "secret-token";
  for (const char* server :
       {"localhost:50051", "127.0.0.1:50051", "[::1]:50051", "localhost", "unix:/run/stance.sock",
        "dns:///localhost:1", "ipv4:127.0.0.1:1", "ipv6:[::1]:1"}) {
    options.server = server;
    EXPECT_TRUE(CheckCredentials(options).ok()) << server;
  }
  for (const char* server : {"pose.example.com:50051", "10.0.0.1:50051", "localhost.example.com:1",
                             "127.0.0.1.example.com:1", ":1", "dns:///pose:1", "dns://127.0.0.1/pose:1",
                             "ipv4:127.0.0.1:1,10.0.0.1:1", "xds:///localhost:1", ""}) {
    options.server = server;
    options.tls.reset();
    const absl::Status refused = CheckCredentials(options);
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << server;
    EXPECT_EQ(std::string(refused.message()).find(options.token), std::string::npos);
    EXPECT_EQ(ConnectChannel(options).status().code(), absl::StatusCode::kInvalidArgument) << server;
    options.tls.emplace();
    EXPECT_TRUE(CheckCredentials(options).ok()) << server;
  }
  options.token.clear();
  options.tls.reset();
  EXPECT_TRUE(CheckCredentials(options).ok());
}

TEST(CheckCredentialsTest, ATokenIsPrintable) {
  ClientOptions options;
  for (const char* token : {"line\nbreak", "\xc3\xa4", "tab\t"}) {
    options.token = token;
    EXPECT_EQ(CheckCredentials(options).code(), absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace stance
