#include "core/base/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace stance {
namespace {

TEST(Random, SameSeedAndStreamGiveTheSameNumbers) {
  Random a(7, 3), b(7, 3);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.Next(), b.Next());
}

TEST(Random, StreamsOfOneSeedDiffer) {
  Random a(7, 0), b(7, 1);
  int equal = 0;
  for (int i = 0; i < 100; ++i) equal += a.Next() == b.Next();
  EXPECT_EQ(equal, 0);
}

TEST(Random, UniformFillsItsRangeEvenly) {
  Random random(1);
  double sum = 0, squares = 0;
  constexpr int kDraws = 200'000;
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.Uniform(-1, 3);
    ASSERT_GE(u, -1);
    ASSERT_LT(u, 3);
    sum += u;
    squares += u * u;
  }
  const double mean = sum / kDraws;
  EXPECT_NEAR(mean, 1, 0.015);                                   // 5 standard errors
  EXPECT_NEAR(squares / kDraws - mean * mean, 16.0 / 12, 0.02);  // (b - a)^2 / 12
}

TEST(Random, NormalHasTheMomentsAskedFor) {
  Random random(2);
  double sum = 0, squares = 0;
  constexpr int kDraws = 200'000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.Normal(2, 0.5);
    sum += x;
    squares += (x - 2) * (x - 2);
  }
  EXPECT_NEAR(sum / kDraws, 2, 0.006);
  EXPECT_NEAR(std::sqrt(squares / kDraws), 0.5, 0.005);
}

TEST(Random, BelowReachesEveryValueAndNoOther) {
  Random random(3);
  int counts[5] = {};
  for (int i = 0; i < 5000; ++i) ++counts[random.Below(5)];
  for (const int count : counts) EXPECT_NEAR(count, 1000, 150);
}

}  // namespace
}  // namespace stance
