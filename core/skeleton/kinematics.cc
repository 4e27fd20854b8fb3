#include "core/skeleton/kinematics.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "core/base/check.h"

namespace stance {

std::vector<Rotation> GlobalRotations(const Skeleton& skeleton, const std::vector<Rotation>& local) {
  STANCE_CHECK(static_cast<int>(local.size()) == skeleton.joint_count());
  std::vector<Rotation> global(local.size());
  global[0] = local[0];
  for (int j = 1; j < skeleton.joint_count(); ++j) global[j] = global[skeleton.parents()[j]] * local[j];
  return global;
}

std::vector<AffineTransform> PoseTransforms(const Skeleton& skeleton, const Points& joints,
                                            const std::vector<Rotation>& global) {
  STANCE_CHECK(joints.rows() == skeleton.joint_count());
  std::vector<AffineTransform> transforms(global.size());
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const Eigen::Vector3f joint = joints.row(j).transpose();
    const Eigen::Vector3f posed =
        j == 0 ? joint : transforms[skeleton.parents()[j]].Apply(joint);  // equation 8
    transforms[j].linear = global[j];
    transforms[j].translation = posed - global[j] * joint;  // equation 9
  }
  return transforms;
}

Points BoneVectors(const Skeleton& skeleton, const Points& joints) {
  Points bones = Points::Zero(joints.rows(), 3);
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const int parent = skeleton.parents()[j];
    if (parent >= 0) bones.row(j) = joints.row(j) - joints.row(parent);
  }
  return bones;
}

Rotation NearestRotation(const Eigen::Matrix3f& matrix) {
  if (!matrix.allFinite() || matrix.squaredNorm() < 1e-24f) return Rotation::Identity();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix.cast<double>(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return (svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose()).cast<float>();
}

Rotation SmallestRotation(const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
  const double from_norm = from.cast<double>().norm(), to_norm = to.cast<double>().norm();
  if (!(from_norm > 1e-12) || !(to_norm > 1e-12)) return Rotation::Identity();
  // FromTwoVectors handles both degenerate cases: it takes a perpendicular axis by SVD near a half turn.
  return Eigen::Quaterniond::FromTwoVectors(from.cast<double>() / from_norm, to.cast<double>() / to_norm)
      .toRotationMatrix()
      .cast<float>();
}

}  // namespace stance
