#include "core/training/shape_parameters.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>
#include <utility>
#include <vector>

namespace stance {
namespace {

double GroupSum(const std::array<double, kShapeFactorCount>& factors, int first, int last) {
  return std::accumulate(&factors[first], &factors[last] + 1, 0.0);
}

const std::vector<std::pair<int, int>> kGroups = {{kMale, kFemale},
                                                  {kAfrican, kCaucasian},
                                                  {kChild, kOld},
                                                  {kMinMuscle, kMaxMuscle},
                                                  {kMinWeight, kMaxWeight},
                                                  {kMinHeight, kMaxHeight},
                                                  {kIdealProportions, kUncommonProportions},
                                                  {kMinCup, kMaxCup},
                                                  {kMinFirmness, kMaxFirmness}};

TEST(ShapeParameters, FactorsOfEachGroupSumToOne) {
  for (int i = 0; i < 200; ++i) {
    Random random(1, i);
    const auto factors = ShapeFactors(RandomShape(random, 30));
    for (const auto& [first, last] : kGroups) EXPECT_NEAR(GroupSum(factors, first, last), 1, 1e-12) << first;
    for (const double factor : factors) EXPECT_GE(factor, 0);
  }
}

TEST(ShapeParameters, InterpolatesBetweenNeighbours) {
  ShapeParameters shape;
  shape.age = 0.25;
  shape.weight = 1.0;
  shape.gender = 1.0;
  const auto factors = ShapeFactors(shape);
  EXPECT_DOUBLE_EQ(factors[kChild], 0.5);
  EXPECT_DOUBLE_EQ(factors[kYoung], 0.5);
  EXPECT_DOUBLE_EQ(factors[kOld], 0);
  EXPECT_DOUBLE_EQ(factors[kMaxWeight], 1);
  EXPECT_DOUBLE_EQ(factors[kMale], 1);
  EXPECT_DOUBLE_EQ(ShapeFactors({})[kYoung], 1);
}

TEST(ShapeParameters, LocalMorphsAreDistinctAndInRange) {
  std::set<size_t> counts;
  for (int i = 0; i < 300; ++i) {
    Random random(2, i);
    const ShapeParameters shape = RandomShape(random, 40);
    std::set<int> pairs;
    for (const ShapeParameters::Local& local : shape.locals) {
      EXPECT_TRUE(local.pair >= 0 && local.pair < 40);
      EXPECT_LE(std::abs(local.amount), 0.9);
      pairs.insert(local.pair);
    }
    EXPECT_EQ(pairs.size(), shape.locals.size());
    counts.insert(shape.locals.size());
  }
  EXPECT_EQ(*counts.begin(), 0u);
  EXPECT_EQ(*counts.rbegin(), 24u);
}

TEST(ShapeParameters, WorksWithFewOrNoLocalMorphs) {
  for (int i = 0; i < 50; ++i) {
    Random random(3, i);
    EXPECT_TRUE(RandomShape(random, 0).locals.empty());
    EXPECT_LE(RandomShape(random, 2).locals.size(), 2u);
  }
}

// Dirichlet(0.6, 0.6, 0.6): mean 1/3, variance (1/3)(2/3) / (1.8 + 1).
TEST(ShapeParameters, EthnicityHasTheDirichletMoments) {
  double sum = 0, squares = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    Random random(4, i);
    const double part = RandomShape(random, 0).ethnicity[0];
    sum += part;
    squares += part * part;
  }
  const double mean = sum / kCount;
  EXPECT_NEAR(mean, 1.0 / 3, 0.01);
  EXPECT_NEAR(squares / kCount - mean * mean, 2.0 / 9 / 2.8, 0.004);
}

}  // namespace
}  // namespace stance
