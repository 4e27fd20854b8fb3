#include "core/training/skinning.h"

#include "core/base/check.h"

namespace stance {

Points SkinPoints(const Points& points, const RowMatrix& weights,
                  const std::vector<AffineTransform>& transforms) {
  const auto joints = static_cast<Eigen::Index>(transforms.size());
  STANCE_CHECK(weights.rows() == points.rows() && weights.cols() == joints);
  Points skinned(points.rows(), 3);
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    Eigen::Matrix3f linear = Eigen::Matrix3f::Zero();
    Eigen::Vector3f translation = Eigen::Vector3f::Zero();
    for (Eigen::Index j = 0; j < joints; ++j) {
      const float weight = weights(v, j);
      if (weight == 0) continue;
      linear += weight * transforms[j].linear;
      translation += weight * transforms[j].translation;
    }
    skinned.row(v) = (linear * points.row(v).transpose() + translation).transpose();
  }
  return skinned;
}

Points TransformJoints(const Points& joints, const std::vector<AffineTransform>& transforms) {
  STANCE_CHECK(static_cast<Eigen::Index>(transforms.size()) == joints.rows());
  Points posed(joints.rows(), 3);
  for (Eigen::Index j = 0; j < joints.rows(); ++j) {
    posed.row(j) = transforms[j].Apply(joints.row(j).transpose()).transpose();
  }
  return posed;
}

}  // namespace stance
