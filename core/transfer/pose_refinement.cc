#include "core/transfer/pose_refinement.h"

#include "core/skeleton/skeleton.h"

namespace stance {

Points RestJoints(const Points& bones) {
  const std::vector<int>& parents = HumanSkeleton().parents();
  Points joints = Points::Zero(kHumanJoints, 3);
  for (int j = 1; j < kHumanJoints; ++j) joints.row(j) = joints.row(parents[j]) + bones.row(j);
  return joints;
}

PyramidInput UnposedInput(const PyramidInput& input, const PoseEstimate& estimate) {
  constexpr float kShortest = 1e-6f;  // of a blended normal that still has a direction
  const Points rest = RestJoints(estimate.bones);
  PyramidInput unposed = input;
  unposed.points.setZero();
  unposed.normals.setZero();
  for (int j = 0; j < kHumanJoints; ++j) {
    const Rotation& rotation = estimate.rotations[j];
    const Eigen::VectorXf weights = estimate.weights.col(j);
    const Points moved =
        ((input.points.rowwise() - estimate.joints.row(j)) * rotation).rowwise() + rest.row(j);
    unposed.points += weights.asDiagonal() * moved;
    unposed.normals += weights.asDiagonal() * (input.normals * rotation);
  }
  for (int64_t i = 0; i < unposed.normals.rows(); ++i) {
    const float length = unposed.normals.row(i).norm();
    if (length > kShortest) {
      unposed.normals.row(i) /= length;
    } else {
      unposed.normals.row(i).setZero();
    }
  }
  return unposed;
}

AffineTransform PoseAgain(const PoseEstimate& first, int joint) {
  const Rotation& rotation = first.rotations[joint];
  const Points rest = RestJoints(first.bones);
  return {rotation, first.joints.row(joint).transpose() - rotation * rest.row(joint).transpose()};
}

PoseEstimate EstimateBehindUnposing(PoseEstimate seen, const PoseEstimate& first) {
  for (int j = 0; j < kHumanJoints; ++j) {
    const AffineTransform again = PoseAgain(first, j);
    seen.joints.row(j) = again.Apply(seen.joints.row(j).transpose()).transpose();
    seen.rotations[j] = NearestRotation(again.linear * seen.rotations[j]);
  }
  return seen;
}

}  // namespace stance
