#include "core/training/reliability.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/transfer/confidence.h"

namespace stance {
namespace {

// The mean over claims of -log likelihood at sigmoid(theta . (logit, 1)), its gradient and its Hessian.
struct Loss {
  double value = 0;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();
};

Loss LogisticLoss(std::span<const Claim> claims, const Eigen::Vector2d& theta) {
  Loss loss;
  for (const Claim& claim : claims) {
    const Eigen::Vector2d x(Logit(claim.probability), 1);
    const double z = theta.dot(x), p = 1 / (1 + std::exp(-z));
    loss.value += std::max(z, 0.0) + std::log1p(std::exp(-std::abs(z))) - claim.outcome * z;
    loss.gradient += (p - claim.outcome) * x;
    loss.hessian += p * (1 - p) * x * x.transpose();
  }
  const double share = 1 / static_cast<double>(claims.size());
  return {loss.value * share, loss.gradient * share, loss.hessian * share};
}

}  // namespace

std::vector<ReliabilityBin> Reliability(std::span<const Claim> claims, int bins) {
  STANCE_CHECK(bins > 0);
  std::vector<ReliabilityBin> result(static_cast<size_t>(bins));
  for (int b = 0; b < bins; ++b) {
    result[static_cast<size_t>(b)].low = static_cast<double>(b) / bins;
    result[static_cast<size_t>(b)].high = static_cast<double>(b + 1) / bins;
  }
  for (const Claim& claim : claims) {
    STANCE_CHECK(claim.probability >= 0 && claim.probability <= 1);
    // By the edges themselves: p * bins may round to the other side of one.
    const auto above = std::find_if(result.begin(), result.end() - 1,
                                    [&](const ReliabilityBin& bin) { return claim.probability < bin.high; });
    ++above->count;
    above->mean_probability += claim.probability;
    above->mean_outcome += claim.outcome;
  }
  for (ReliabilityBin& bin : result) {
    if (bin.count == 0) continue;
    bin.mean_probability /= static_cast<double>(bin.count);
    bin.mean_outcome /= static_cast<double>(bin.count);
  }
  return result;
}

double ExpectedCalibrationError(std::span<const ReliabilityBin> bins) {
  double sum = 0;
  int64_t count = 0;
  for (const ReliabilityBin& bin : bins) {
    sum += static_cast<double>(bin.count) * std::abs(bin.mean_probability - bin.mean_outcome);
    count += bin.count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

double BrierScore(std::span<const Claim> claims) {
  double sum = 0;
  for (const Claim& claim : claims) sum += std::pow(claim.probability - claim.outcome, 2);
  return claims.empty() ? 0 : sum / static_cast<double>(claims.size());
}

std::optional<ConfidenceCalibration> FitCalibration(std::span<const Claim> claims) {
  if (claims.empty()) return std::nullopt;
  // Far fewer steps do: the loss is convex, and near its minimum each one squares the error. Where outcomes
  // are separated or all alike there is no minimum: theta runs off, and the curvature 1/n sum p (1 - p)
  // vanishes with the gradient.
  constexpr int kMostSteps = 50;
  constexpr double kFlat = 1e-10, kLeastCurvature = 1e-6, kSingular = 1e-9, kRounding = 1e-14;
  Eigen::Vector2d theta(1, 0);
  Loss loss = LogisticLoss(claims, theta);
  for (int step = 0; step < kMostSteps; ++step) {
    const double trace = loss.hessian.trace();
    if (loss.hessian(1, 1) < kLeastCurvature || loss.hessian.determinant() < kSingular * trace * trace) break;
    if (loss.gradient.norm() < kFlat) {
      if (!(theta[0] > 0)) break;
      return ConfidenceCalibration{.scale = theta[0], .bias = theta[1]};
    }
    Eigen::Vector2d move = loss.hessian.inverse() * loss.gradient;
    Loss next = LogisticLoss(claims, theta - move);
    while (!(next.value <= loss.value + kRounding) && move.norm() > kRounding) {
      move /= 2;
      next = LogisticLoss(claims, theta - move);
    }
    theta -= move;
    loss = next;
  }
  return std::nullopt;
}

std::vector<Claim> Calibrated(std::span<const Claim> claims, const ConfidenceCalibration& calibration) {
  std::vector<Claim> calibrated(claims.begin(), claims.end());
  for (Claim& claim : calibrated) claim.probability = CalibratedConfidence(claim.probability, calibration);
  return calibrated;
}

}  // namespace stance
