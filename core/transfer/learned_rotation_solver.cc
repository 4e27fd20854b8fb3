#include "core/transfer/learned_rotation_solver.h"

#include "core/base/check.h"

namespace stance {
namespace {

// Unit vectors from the joint to its children, as columns; zero where a bone has no length.
Eigen::Matrix3Xf Bones(const Skeleton& skeleton, int joint, const Points& joints) {
  const std::vector<int>& children = skeleton.children(joint);
  Eigen::Matrix3Xf bones(3, std::ssize(children));
  for (int64_t i = 0; i < bones.cols(); ++i) {
    bones.col(i) = (joints.row(children[i]) - joints.row(joint)).transpose().stableNormalized();
  }
  return bones;
}

}  // namespace

std::vector<Rotation> LearnedRotationSolver::Solve(const Skeleton& skeleton, const TriangleMesh&,
                                                   const Rig& source_rig, const TriangleMesh&,
                                                   const Rig& reference_rig) const {
  const auto joints = static_cast<size_t>(skeleton.joint_count());
  STANCE_CHECK(source_rig.rotations.size() == joints && reference_rig.rotations.size() == joints);
  std::vector<Rotation> rotations(joints);
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    rotations[j] = reference_rig.rotations[j] * source_rig.rotations[j].transpose();
    const Eigen::Matrix3Xf from = Bones(skeleton, j, source_rig.joints),
                           to = Bones(skeleton, j, reference_rig.joints);
    if (from.cols() == 1) {
      rotations[j] = SmallestRotation(rotations[j] * from.col(0), to.col(0)) * rotations[j];
    } else if (from.cols() > 1) {
      // The learned rotation decides only what the bones leave open, as three in one line would.
      rotations[j] = NearestRotation(to * from.transpose() + 1e-3f * rotations[j]);
    }
  }
  return rotations;
}

}  // namespace stance
