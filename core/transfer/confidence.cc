#include "core/transfer/confidence.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/mesh/measure.h"

namespace stance {

double Logit(double probability) {
  constexpr double kLeast = 1e-6;
  const double p = std::clamp(probability, kLeast, 1 - kLeast);
  return std::log(p / (1 - p));
}

double CalibratedConfidence(double probability, const ConfidenceCalibration& calibration) {
  if (calibration == ConfidenceCalibration{}) return probability;
  return 1 / (1 + std::exp(-(calibration.scale * Logit(probability) + calibration.bias)));
}

Eigen::VectorXf JointShares(const Points& positions, const Faces& faces, const RowMatrix& weights) {
  STANCE_CHECK(weights.rows() == positions.rows());
  Eigen::VectorXd areas = VertexAreas(positions, faces);
  if (!(areas.sum() > 0)) areas.setOnes();
  const Eigen::VectorXd moved = weights.cast<double>().transpose() * areas;
  return (moved / moved.sum()).cast<float>();
}

std::optional<float> TransferConfidence(const Eigen::VectorXf& shares, const Eigen::VectorXf& source,
                                        const Eigen::VectorXf& reference) {
  if (source.size() == 0 || reference.size() == 0) return std::nullopt;
  STANCE_CHECK(source.size() == shares.size() && reference.size() == shares.size());
  const float confidence = (shares.array() * source.array() * reference.array()).sum();
  return std::clamp(confidence, 0.0f, 1.0f);  // rounding
}

}  // namespace stance
