// Artists' proportions: scales of the limbs along and across their bones.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/random.h"
#include "core/base/types.h"
#include "core/skeleton/kinematics.h"

namespace stance {

// (24) scales of each joint's part of the body along the rest pose's axes.
using LimbScales = std::vector<Eigen::Vector3f>;

// Trunk, head, legs, feet, arms and hands scaled each on its own, both sides alike, by some 15 %.
LimbScales SampleLimbScales(Random& random);

// PoseTransforms (kinematics.h) with each joint's part scaled at rest: the linear part is global * scale.
std::vector<AffineTransform> ScaledPoseTransforms(const Points& joints, const std::vector<Rotation>& global,
                                                  const LimbScales& scales);

}  // namespace stance
