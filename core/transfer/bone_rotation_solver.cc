#include "core/transfer/bone_rotation_solver.h"

#include <limits>

namespace stance {
namespace {

// Unit bone vectors out of a joint, as columns; a zero column where the bone has no length.
Eigen::Matrix3Xf BoneDirections(const Skeleton& skeleton, int joint, const Points& joints,
                                const Points& virtual_child) {
  const std::vector<int>& children = skeleton.children(joint);
  Eigen::Matrix3Xf bones(3, std::max<size_t>(1, children.size()));
  if (children.empty()) {
    bones.col(0) = (virtual_child.row(joint) - joints.row(joint)).transpose();
  }
  for (size_t i = 0; i < children.size(); ++i) {
    bones.col(static_cast<int64_t>(i)) = (joints.row(children[i]) - joints.row(joint)).transpose();
  }
  for (int64_t i = 0; i < bones.cols(); ++i) {
    const float length = bones.col(i).norm();
    if (length > 1e-9f) {
      bones.col(i) /= length;
    } else {
      bones.col(i).setZero();  // also where the length is NaN
    }
  }
  return bones;
}

}  // namespace

Points VirtualChildren(const Points& vertices, const RowMatrix& weights) {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> sums(weights.cols(), 3);
  sums.setZero();
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(weights.cols());
  for (int64_t v = 0; v < vertices.rows(); ++v) {
    Eigen::Index joint;
    weights.row(v).maxCoeff(&joint);
    sums.row(joint) += vertices.row(v).cast<double>();
    counts[joint] += 1;
  }
  Points children(weights.cols(), 3);
  for (int64_t j = 0; j < weights.cols(); ++j) {
    if (counts[j] > 0) {
      children.row(j) = (sums.row(j) / counts[j]).cast<float>();
    } else {
      children.row(j).setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  }
  return children;
}

std::vector<Rotation> BoneRotationSolver::Solve(const Skeleton& skeleton, const TriangleMesh& source,
                                                const Rig& source_rig, const TriangleMesh& reference,
                                                const Rig& reference_rig) const {
  const Points source_leaves = VirtualChildren(source.positions, source_rig.weights);
  const Points reference_leaves = VirtualChildren(reference.positions, reference_rig.weights);
  std::vector<Rotation> rotations(skeleton.joint_count(), Rotation::Identity());
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const Eigen::Matrix3Xf from = BoneDirections(skeleton, j, source_rig.joints, source_leaves);
    const Eigen::Matrix3Xf to = BoneDirections(skeleton, j, reference_rig.joints, reference_leaves);
    const int parent = skeleton.parents()[j];
    const Rotation inherited = parent >= 0 ? rotations[parent] : Rotation::Identity();
    if (from.cols() > 1) {
      const Eigen::Matrix3f covariance = to * from.transpose();
      rotations[j] = covariance.squaredNorm() > 1e-12f ? NearestRotation(covariance) : inherited;
    } else if (from.col(0).squaredNorm() == 0 || to.col(0).squaredNorm() == 0) {
      rotations[j] = inherited;
    } else if (twist_ == Twist::kInherited) {
      rotations[j] = SmallestRotation(inherited * from.col(0), to.col(0)) * inherited;
    } else {
      rotations[j] = SmallestRotation(from.col(0), to.col(0));
    }
  }
  return rotations;
}

}  // namespace stance
