#include "core/transfer/joint_fit.h"

#include <Eigen/Cholesky>

#include "core/base/check.h"

namespace stance {

Points FitJoints(const Skeleton& skeleton, const FoundSkeleton& found, float stiffness) {
  const int64_t count = skeleton.joint_count();
  STANCE_CHECK(found.joints.rows() == count && found.bones.rows() == count &&
               std::ssize(found.rotations) == count && found.confidence.size() == count && stiffness >= 0);
  Eigen::MatrixXf matrix = Eigen::MatrixXf::Identity(count, count);
  Points right = found.joints;
  for (int64_t j = 1; j < count; ++j) {
    const int p = skeleton.parents()[j];
    const float weight = stiffness * found.confidence[j] * found.confidence[p];
    matrix(j, j) += weight;
    matrix(p, p) += weight;
    matrix(j, p) -= weight;
    matrix(p, j) -= weight;
    const Eigen::RowVector3f bone = found.bones.row(j) * found.rotations[p].transpose();
    right.row(j) += weight * bone;
    right.row(p) -= weight * bone;
  }
  return matrix.llt().solve(right);
}

}  // namespace stance
