#include "core/transfer/confidence.h"

#include <algorithm>

#include "core/base/check.h"
#include "core/mesh/measure.h"

namespace stance {

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
