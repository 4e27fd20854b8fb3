#include "server/batching/cost_estimator.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/random.h"

namespace stance {
namespace {

constexpr int kKind = 3;

double Seconds(const CostEstimator& estimator, int64_t vertices, int kind = kKind) {
  return ToSeconds(estimator.Estimate(kind, vertices));
}

void Fill(CostEstimator& estimator, double fixed, double vertex, int count) {
  for (int i = 0; i < count; ++i) estimator.Learn(kKind, {1000, fixed, 1000 * vertex});
}

TEST(CostEstimatorTest, ThinksWhatItHasNotMeasuredQuick) {
  CostEstimator estimator;
  EXPECT_NEAR(Seconds(estimator, 10'000), 1e-3 + 1e-2, 1e-9);
  Fill(estimator, 10, 1e-2, CostEstimator::kLeast - 1);
  EXPECT_NEAR(Seconds(estimator, 10'000), 1e-3 + 1e-2, 1e-9);
  Fill(estimator, 10, 1e-2, 1);
  EXPECT_NEAR(Seconds(estimator, 10'000), 10 + 100, 1e-6);
  EXPECT_NEAR(Seconds(estimator, 10'000, kKind + 1), 1e-3 + 1e-2, 1e-9) << "kinds are apart";
}

TEST(CostEstimatorTest, LearnsWhatEachPhaseCosts) {
  CostEstimator estimator;
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const int64_t vertices = 100 + random.Below(100'000);
    estimator.Learn(kKind, {vertices, 0.05, 2e-6 * static_cast<double>(vertices)});
  }
  for (const int64_t vertices : {1, 642, 1'000'000}) {
    EXPECT_NEAR(Seconds(estimator, vertices), 0.05 + 2e-6 * static_cast<double>(vertices), 1e-8) << vertices;
  }
}

// The theorem of the median: fewer than half, however wrong, leave it among the others.
TEST(CostEstimatorTest, AMinorityOfOutliersMovesNothing) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    CostEstimator estimator;
    for (int i = 0; i < 100; ++i) estimator.Learn(kKind, {1000, 7.0, 7.0});  // forgotten
    const int window = static_cast<int>(CostEstimator::kWindow);
    int outliers = window / 2;
    for (int left = window; left > 0; --left) {
      if (random.Below(left) < outliers) {
        --outliers;
        const double wrong = random.Chance(0.5) ? 1e9 : 0.0;
        estimator.Learn(kKind, {1000, wrong, wrong});
      } else {
        const double right = random.Uniform(0.1, 0.2);
        estimator.Learn(kKind, {1000, right, right});
      }
    }
    EXPECT_GE(Seconds(estimator, 1000), 0.2 - 1e-8);
    EXPECT_LE(Seconds(estimator, 1000), 0.4);
  }
}

TEST(CostEstimatorTest, BelievesALastingChangeAfterHalfAWindow) {
  CostEstimator estimator;
  Fill(estimator, 5, 0, static_cast<int>(CostEstimator::kWindow));
  Fill(estimator, 0.1, 0, static_cast<int>(CostEstimator::kWindow / 2));
  EXPECT_NEAR(Seconds(estimator, 1), 5, 1e-6);
  Fill(estimator, 0.1, 0, 1);
  EXPECT_NEAR(Seconds(estimator, 1), 0.1, 1e-6);
}

TEST(CostEstimatorTest, IgnoresWhatIsNoCost) {
  CostEstimator estimator;
  Fill(estimator, 1, 0, 3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const MeasuredCost& cost :
       {MeasuredCost{1000, nan, 0}, MeasuredCost{1000, 0, nan}, MeasuredCost{1000, infinity, 0},
        MeasuredCost{1000, 0, -1}, MeasuredCost{1000, -1, 0}, MeasuredCost{0, 0, 0},
        MeasuredCost{-5, 0, 0}}) {
    for (size_t i = 0; i < CostEstimator::kWindow; ++i) estimator.Learn(kKind, cost);
  }
  EXPECT_NEAR(Seconds(estimator, 1000), 1, 1e-9);
}

TEST(CostEstimatorTest, StaysWithinItsBounds) {
  CostEstimator estimator;
  Fill(estimator, 0, 0, 3);
  EXPECT_EQ(estimator.Estimate(kKind, 1000), Duration(1));
  EXPECT_EQ(estimator.Estimate(kKind, -1), Duration(1));
  Fill(estimator, 1e300, 1e300, static_cast<int>(CostEstimator::kWindow));
  EXPECT_EQ(estimator.Estimate(kKind, std::numeric_limits<int64_t>::max()), std::chrono::hours(1));
}

}  // namespace
}  // namespace stance
