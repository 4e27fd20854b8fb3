#include "core/training/reliability.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/transfer/confidence.h"

namespace stance {
namespace {

// Probabilities of many sizes, as a network states them: logits that are normal.
std::vector<double> RandomProbabilities(int count, uint64_t seed) {
  Random random(seed);
  std::vector<double> probabilities;
  for (int i = 0; i < count; ++i) {
    probabilities.push_back(1 / (1 + std::exp(-random.Normal(0.7, 1.8))));
  }
  return probabilities;
}

// Each probability claimed of as many things as come true at exactly that rate.
std::vector<Claim> ExactClaims(const std::vector<double>& probabilities) {
  std::vector<Claim> claims;
  for (const double p : probabilities) claims.push_back({p, p});
  return claims;
}

// What comes true is drawn.
std::vector<Claim> DrawnClaims(const std::vector<double>& probabilities, uint64_t seed) {
  Random random(seed);
  std::vector<Claim> claims;
  for (const double p : probabilities) claims.push_back({p, random.Chance(p) ? 1.0 : 0.0});
  return claims;
}

TEST(Reliability, BinsPartitionTheClaims) {
  std::vector<Claim> claims = DrawnClaims(RandomProbabilities(1000, 1), 2);
  for (const double edge : {0.0, 0.1, 0.3, 0.7, 0.9, 1.0}) claims.push_back({edge, 1});
  const std::vector<ReliabilityBin> bins = Reliability(claims);
  ASSERT_EQ(bins.size(), static_cast<size_t>(kReliabilityBins));
  EXPECT_EQ(bins.back().high, 1);
  int64_t count = 0;
  double probability = 0, outcome = 0, all_probability = 0, all_outcome = 0;
  for (size_t b = 0; b < bins.size(); ++b) {
    EXPECT_EQ(bins[b].low, b > 0 ? bins[b - 1].high : 0);
    if (bins[b].count > 0) {
      EXPECT_GE(bins[b].mean_probability, bins[b].low);
      EXPECT_LE(bins[b].mean_probability, bins[b].high);
    }
    count += bins[b].count;
    probability += bins[b].mean_probability * static_cast<double>(bins[b].count);
    outcome += bins[b].mean_outcome * static_cast<double>(bins[b].count);
  }
  for (const Claim& claim : claims) {
    all_probability += claim.probability;
    all_outcome += claim.outcome;
  }
  EXPECT_EQ(count, std::ssize(claims));
  EXPECT_NEAR(probability, all_probability, 1e-9);
  EXPECT_NEAR(outcome, all_outcome, 1e-9);
}

TEST(Reliability, AnEdgeBelongsToTheBinAboveItAndOneToTheLast) {
  for (int b = 0; b < 10; ++b) {
    EXPECT_EQ(Reliability(std::vector<Claim>{{b / 10.0, 0}})[static_cast<size_t>(b)].count, 1) << b;
  }
  EXPECT_EQ(Reliability(std::vector<Claim>{{1.0, 0}})[9].count, 1);
}

TEST(ExpectedCalibrationError, OfCalibratedClaimsIsZero) {
  EXPECT_NEAR(ExpectedCalibrationError(Reliability(ExactClaims(RandomProbabilities(1000, 3)))), 0, 1e-12);
  EXPECT_LT(ExpectedCalibrationError(Reliability(DrawnClaims(RandomProbabilities(50'000, 4), 5))), 0.01);
  EXPECT_EQ(ExpectedCalibrationError(Reliability({})), 0);
}

// Bins [0.2, 0.3): stated 0.25, true 1/2; [0.8, 0.9): stated 0.8, true 0.
TEST(ExpectedCalibrationError, HandComputed) {
  const std::vector<Claim> claims = {{0.2, 1}, {0.29, 0}, {0.8, 0}};
  EXPECT_NEAR(ExpectedCalibrationError(Reliability(claims)), (2 * (0.5 - 0.245) + 0.8) / 3, 1e-12);
  EXPECT_NEAR(BrierScore(claims), (0.64 + 0.0841 + 0.64) / 3, 1e-12);
}

TEST(BrierScore, OfCertainTruthsIsZeroAndOfCertainFalsehoodsOne) {
  EXPECT_EQ(BrierScore(std::vector<Claim>{{1, 1}, {0, 0}}), 0);
  EXPECT_EQ(BrierScore(std::vector<Claim>{{1, 0}, {0, 1}}), 1);
  EXPECT_EQ(BrierScore({}), 0);
}

TEST(FitCalibration, LeavesCalibratedClaimsAsTheyAre) {
  const auto exact = FitCalibration(ExactClaims(RandomProbabilities(1000, 6)));
  ASSERT_TRUE(exact.has_value());
  EXPECT_NEAR(exact->scale, 1, 1e-8);
  EXPECT_NEAR(exact->bias, 0, 1e-8);
  const auto drawn = FitCalibration(DrawnClaims(RandomProbabilities(50'000, 7), 8));
  ASSERT_TRUE(drawn.has_value());
  EXPECT_NEAR(drawn->scale, 1, 0.05);
  EXPECT_NEAR(drawn->bias, 0, 0.05);
}

// Claims behind a known distortion (that leaves them within what Logit tells apart): the fit is its inverse.
TEST(FitCalibration, UndoesAKnownDistortion) {
  for (const ConfidenceCalibration& distortion :
       {ConfidenceCalibration{1.8, 0}, {0.4, 1}, {1, -2}, {1.5, 2}}) {
    const std::vector<Claim> distorted = Calibrated(ExactClaims(RandomProbabilities(1000, 9)), distortion);
    const auto fit = FitCalibration(distorted);
    ASSERT_TRUE(fit.has_value()) << distortion.scale;
    EXPECT_NEAR(fit->scale, 1 / distortion.scale, 1e-3);
    EXPECT_NEAR(fit->bias, -distortion.bias / distortion.scale, 1e-3);
    EXPECT_GT(ExpectedCalibrationError(Reliability(distorted)), 0.05);
    EXPECT_LT(ExpectedCalibrationError(Reliability(Calibrated(distorted, *fit))), 1e-4);
  }
}

// No other calibration near it has a greater likelihood.
TEST(FitCalibration, IsLikeliest) {
  const std::vector<Claim> claims =
      Calibrated(DrawnClaims(RandomProbabilities(500, 10), 11), {.scale = 1.7, .bias = 0.5});
  const auto likelihood = [&](const ConfidenceCalibration& calibration) {
    double sum = 0;
    for (const Claim& claim : Calibrated(claims, calibration)) {
      sum += std::log(claim.outcome > 0.5 ? claim.probability : 1 - claim.probability);
    }
    return sum;
  };
  const auto fit = FitCalibration(claims);
  ASSERT_TRUE(fit.has_value());
  for (const auto& [scale, bias] : {std::pair{0.01, 0.0}, {-0.01, 0.0}, {0.0, 0.01}, {0.0, -0.01}}) {
    EXPECT_LT(likelihood({fit->scale + scale, fit->bias + bias}), likelihood(*fit));
  }
}

TEST(FitCalibration, IsNothingWhereNoneIsLikeliest) {
  EXPECT_FALSE(FitCalibration({}).has_value());
  EXPECT_FALSE(FitCalibration(std::vector<Claim>{{0.3, 1}}).has_value());
  EXPECT_FALSE(FitCalibration(std::vector<Claim>(10, {0.3, 0})).has_value());                  // all alike
  EXPECT_FALSE(FitCalibration(std::vector<Claim>{{0.3, 1}, {0.6, 1}, {0.9, 1}}).has_value());  // one outcome
  EXPECT_FALSE(FitCalibration(std::vector<Claim>{{0.1, 0}, {0.2, 0}, {0.8, 1}, {0.9, 1}}).has_value());
  EXPECT_FALSE(  // outcomes that fall
      FitCalibration(std::vector<Claim>{{0.1, 1}, {0.2, 0}, {0.3, 1}, {0.8, 0}, {0.9, 1}, {0.95, 0}})
          .has_value());
}

}  // namespace
}  // namespace stance
