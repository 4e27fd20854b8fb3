#include "core/transfer/learned_rotation_solver.h"

#include <Eigen/Geometry>
#include <utility>

#include "core/base/check.h"

namespace stance {
namespace {

// What the learned rotation of a joint with several children counts for beside each of its bones.
constexpr float kLearnedWeight = 1;

// The rotation of joint j that carries its rest bones onto `joints`, nearest to `learned`.
Rotation FitBones(const std::vector<int>& children, int j, const Rig& rig) {
  const Rotation& learned = rig.rotations[j];
  const auto posed = [&](int child) -> Eigen::Vector3f {
    return (rig.joints.row(child) - rig.joints.row(j)).transpose();
  };
  if (children.size() == 1) {
    const Eigen::Vector3f rest = rig.bones.row(children[0]).transpose();
    return SmallestRotation(learned * rest, posed(children[0])) * learned;
  }
  Eigen::Matrix3f fit = kLearnedWeight * learned;
  for (const int child : children) {
    fit += posed(child).stableNormalized() * rig.bones.row(child).stableNormalized();
  }
  return NearestRotation(fit);
}

}  // namespace

std::vector<Rotation> LearnedRotationSolver::Corrected(const Skeleton& skeleton, const Rig& rig) const {
  const auto joints = static_cast<size_t>(skeleton.joint_count());
  STANCE_CHECK(rig.rotations.size() == joints && rig.bones.rows() == skeleton.joint_count());
  std::vector<Rotation> rotations = rig.rotations;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const std::vector<int>& children = skeleton.children(j);
    if (children.empty()) continue;
    const Eigen::Quaternionf learned(rotations[j]), fitted(FitBones(children, j, rig));
    rotations[j] = learned.slerp(correction_, fitted).normalized().toRotationMatrix();
  }
  // After the correction: misplaced joints bend limbs backwards as misjudged rotations do.
  if (limit_) rotations = WithinAnatomicalLimits(std::move(rotations), *limit_);
  return rotations;
}

std::vector<Rotation> LearnedRotationSolver::Solve(const Skeleton& skeleton, const TriangleMesh&,
                                                   const Rig& source_rig, const TriangleMesh&,
                                                   const Rig& reference_rig) const {
  const std::vector<Rotation> from = Corrected(skeleton, source_rig);
  std::vector<Rotation> rotations = Corrected(skeleton, reference_rig);
  for (size_t j = 0; j < rotations.size(); ++j) rotations[j] *= from[j].transpose();
  return rotations;
}

}  // namespace stance
