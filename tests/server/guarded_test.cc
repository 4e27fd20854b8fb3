#include "server/guarded.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

namespace stance {
namespace {

TEST(GuardedTest, PassesOnWhatTheWorkReturns) {
  EXPECT_TRUE(Guarded("working", [] { return absl::OkStatus(); }).ok());
  EXPECT_EQ(Guarded("working", [] { return absl::NotFoundError("x"); }), absl::NotFoundError("x"));
}

TEST(GuardedTest, TurnsExceptionsIntoStatuses) {
  const absl::Status memory = Guarded("working", []() -> absl::Status { throw std::bad_alloc(); });
  EXPECT_EQ(memory.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(memory), "OUT_OF_MEMORY");
  const absl::Status other = Guarded("working", []() -> absl::Status { throw std::length_error("long"); });
  EXPECT_EQ(other.code(), absl::StatusCode::kInternal);
  EXPECT_EQ(std::string(other.message()), "working: long");
}

}  // namespace
}  // namespace stance
