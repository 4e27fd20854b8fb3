#include "client/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stance {
namespace {

using ::testing::HasSubstr;

TEST(ConnectTest, NobodyListeningIsUnavailableAndNamesTheServer) {
  ClientOptions options;
  options.server = "unix:/nonexistent/stance.sock";
  options.connect_timeout = std::chrono::milliseconds(50);
  const auto client = StanceClient::Connect(options);
  EXPECT_EQ(client.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(client.status().message()), HasSubstr(options.server));
}

}  // namespace
}  // namespace stance
