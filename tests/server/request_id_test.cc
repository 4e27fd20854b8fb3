#include "server/request_id.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace stance {
namespace {

TEST(RequestIdTest, MakesDistinctVersion4Uuids) {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) {
    const std::string id = MakeRequestId();
    EXPECT_THAT(
        id, ::testing::MatchesRegex("[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"));
    EXPECT_TRUE(seen.insert(id).second);
  }
}

TEST(RequestIdTest, KeepsTheCallersOwn) {
  EXPECT_EQ(ChooseRequestId("my request 7").value(), "my request 7");
  EXPECT_EQ(ChooseRequestId("").value().size(), 36u);
  EXPECT_EQ(ChooseRequestId(std::string(64, 'a')).value(), std::string(64, 'a'));
}

TEST(RequestIdTest, RefusesTooLongAndUnprintableOnes) {
  EXPECT_EQ(ChooseRequestId(std::string(65, 'a')).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ChooseRequestId("a\nb").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ChooseRequestId("\xc3\xa4").status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace stance
