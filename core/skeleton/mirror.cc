#include "core/skeleton/mirror.h"

namespace stance {

std::vector<Rotation> MirroredRotations(const std::vector<Rotation>& rotations) {
  const Eigen::Vector3f flip(-1, 1, 1);
  std::vector<Rotation> mirrored(rotations.size());
  for (int j = 0; j < static_cast<int>(rotations.size()); ++j) {
    mirrored[j] = flip.asDiagonal() * rotations[MirrorJoint(j)] * flip.asDiagonal();
  }
  return mirrored;
}

Points MirroredJoints(const Points& joints) {
  Points mirrored(joints.rows(), 3);
  for (int j = 0; j < joints.rows(); ++j) mirrored.row(j) = joints.row(MirrorJoint(j));
  mirrored.col(0) *= -1;
  return mirrored;
}

RowMatrix MirroredWeights(const RowMatrix& weights) {
  RowMatrix mirrored(weights.rows(), kHumanJoints);
  for (int j = 0; j < kHumanJoints; ++j) mirrored.col(j) = weights.col(MirrorJoint(j));
  return mirrored;
}

}  // namespace stance
