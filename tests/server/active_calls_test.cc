#include "server/active_calls.h"

#include <gtest/gtest.h>

#include <future>

namespace stance {
namespace {

TEST(ActiveCallsTest, WaitsForTheLastCall) {
  ActiveCalls calls;
  ASSERT_TRUE(calls.Enter());
  ASSERT_TRUE(calls.Enter());
  EXPECT_FALSE(calls.AwaitNone(RealClock().Now()));
  calls.Leave();
  EXPECT_FALSE(calls.AwaitNone(RealClock().Now()));
  auto none = std::async(std::launch::async,
                         [&calls] { return calls.AwaitNone(RealClock().Now() + std::chrono::minutes(1)); });
  calls.Leave();
  EXPECT_TRUE(none.get());
}

// Callers that keep coming are refused, not waited for.
TEST(ActiveCallsTest, NobodyIsCountedOnceItIsClosed) {
  ActiveCalls calls;
  ASSERT_TRUE(calls.Enter());
  calls.Close();
  EXPECT_FALSE(calls.Enter());
  calls.Leave();
  EXPECT_TRUE(calls.AwaitNone(RealClock().Now()));
}

}  // namespace
}  // namespace stance
