#include "core/transfer/rotation_fit.h"

#include "core/base/check.h"

namespace stance {

std::vector<Rotation> FitRotations(const Skeleton& skeleton, const DeformedSurface& surface) {
  const int64_t vertices = surface.from.rows();
  STANCE_CHECK(surface.to.rows() == vertices && surface.weights.rows() == vertices &&
               surface.mass.size() == vertices && surface.weights.cols() == skeleton.joint_count());
  // Of the joint's own spread: far less than what two directions of a limb have.
  constexpr double kPull = 1e-3;
  const Eigen::MatrixX3d from = surface.from.cast<double>(), to = surface.to.cast<double>();
  std::vector<Rotation> rotations;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const int parent = skeleton.parents()[j];
    const Rotation before = parent < 0 ? Rotation(Rotation::Identity()) : rotations[parent];
    const Eigen::VectorXd counts = surface.mass.cwiseProduct(surface.weights.col(j).cast<double>());
    const double total = counts.sum();
    if (!(total > 0)) {
      rotations.push_back(before);
      continue;
    }
    const Eigen::MatrixX3d around = from.rowwise() - (counts.transpose() * from / total).eval();
    // Moments about one mean need no other.
    const Eigen::Matrix3d moments = to.transpose() * counts.asDiagonal() * around;
    const double spread = counts.dot(around.rowwise().squaredNorm());
    if (!(spread > 0)) {
      rotations.push_back(before);
      continue;
    }
    rotations.push_back(NearestRotation((moments / spread + kPull * before.cast<double>()).cast<float>()));
  }
  return rotations;
}

}  // namespace stance
