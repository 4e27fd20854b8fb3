// Forward kinematics and linear blend skinning's bone transforms.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/types.h"
#include "core/skeleton/skeleton.h"

namespace stance {

using Rotation = Eigen::Matrix3f;
// x -> linear * x + translation, in the character's frame, metres.
struct AffineTransform {
  Eigen::Matrix3f linear = Eigen::Matrix3f::Identity();
  Eigen::Vector3f translation = Eigen::Vector3f::Zero();

  Eigen::Vector3f Apply(const Eigen::Vector3f& point) const { return linear * point + translation; }
};

// Each joint's global rotation G_j = G_parent(j) * L_j from its rotation L_j relative to its parent.
std::vector<Rotation> GlobalRotations(const Skeleton& skeleton, const std::vector<Rotation>& local);

// The transforms that carry a rest skeleton (joints (J, 3)) into the pose of the given global rotations
// (global = rotation from the rest pose): the root turns about its own joint, which stays where it is, and
// every joint keeps its place on its parent's bone (paper A, equations 8 and 9).
std::vector<AffineTransform> PoseTransforms(const Skeleton& skeleton, const Points& joints,
                                            const std::vector<Rotation>& global);

// (J, 3) from each joint's parent to the joint; zero at the root.
Points BoneVectors(const Skeleton& skeleton, const Points& joints);

// The rotation nearest to `matrix` in the Frobenius norm (SVD, reflections fixed). The identity where the
// matrix is zero or not finite.
Rotation NearestRotation(const Eigen::Matrix3f& matrix);

// The smallest rotation that carries direction `from` onto direction `to` (Rodrigues). Identity if either is
// shorter than 1e-12 or they are parallel; a half turn about some perpendicular axis if they are opposite.
Rotation SmallestRotation(const Eigen::Vector3f& from, const Eigen::Vector3f& to);

}  // namespace stance
