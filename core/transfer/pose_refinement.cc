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

std::vector<AffineTransform> PoseAgain(const PoseEstimate& first) {
  const Points rest = RestJoints(first.bones);
  std::vector<AffineTransform> transforms;
  for (int j = 0; j < kHumanJoints; ++j) {
    const Rotation& rotation = first.rotations[j];
    transforms.push_back({rotation, first.joints.row(j).transpose() - rotation * rest.row(j).transpose()});
  }
  return transforms;
}

PoseEstimate EstimateBehindUnposing(PoseEstimate seen, const PoseEstimate& first) {
  const std::vector<AffineTransform> again = PoseAgain(first);
  for (int j = 0; j < kHumanJoints; ++j) {
    seen.joints.row(j) = again[j].Apply(seen.joints.row(j).transpose()).transpose();
    seen.rotations[j] = NearestRotation(again[j].linear * seen.rotations[j]);
  }
  return seen;
}

}  // namespace stance
