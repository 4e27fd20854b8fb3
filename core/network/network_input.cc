#include "core/network/network_input.h"

#include "core/base/check.h"

namespace stance {

Normalization NormalizationOf(const Points& points) {
  STANCE_CHECK(points.rows() > 0);
  const Eigen::RowVector3f low = points.colwise().minCoeff(), high = points.colwise().maxCoeff();
  const float diagonal = (high - low).norm();
  return {0.5f * (low + high), diagonal > 0 ? diagonal : 1.0f};
}

}  // namespace stance
