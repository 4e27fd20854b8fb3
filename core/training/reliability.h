// How well stated probabilities match what happens, and the scaling under which they match best.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/network/model_manifest.h"

namespace stance {

// One stated probability and what came of it.
struct Claim {
  double probability = 0;  // 0..1
  double outcome = 0;      // 1: it was so, 0: it was not; between: the share of which it was so
};

// The claims with a probability in [low, high), of the last bin in [low, high].
struct ReliabilityBin {
  double low = 0, high = 0;
  int64_t count = 0;
  double mean_probability = 0;  // 0 where there are none
  double mean_outcome = 0;      // likewise: the fraction that was so
};

inline constexpr int kReliabilityBins = 10;

// Bins of equal width, which partition the claims. REQUIRES: probabilities in [0, 1]; bins > 0.
std::vector<ReliabilityBin> Reliability(std::span<const Claim> claims, int bins = kReliabilityBins);

// sum_b n_b / n |mean probability - mean outcome| (Guo et al., On Calibration of Modern Neural Networks,
// 2017, equation 3); 0 without claims.
double ExpectedCalibrationError(std::span<const ReliabilityBin> bins);

// The mean of (probability - outcome)^2 (Brier 1950); 0 without claims.
double BrierScore(std::span<const Claim> claims);

// Platt scaling: the calibration that makes the claims' outcomes likeliest, by Newton's method on the
// logistic regression of the outcomes on the logits. Nothing where there is no such calibration with a scale
// above 0: too few claims, all alike, all with one outcome, outcomes that the probabilities separate, or
// that fall as they rise.
std::optional<ConfidenceCalibration> FitCalibration(std::span<const Claim> claims);

// The claims as they would be made behind the calibration.
std::vector<Claim> Calibrated(std::span<const Claim> claims, const ConfidenceCalibration& calibration);

}  // namespace stance
