// A rigged figure of balls: the smallest thing with a human skeleton.
#pragma once

#include "core/transfer/parts.h"

namespace stance::testing {

struct Puppet {
  TriangleMesh mesh;
  Rig rig;  // rigid weights
};

// 24 joints in a T-pose, 1.7 m tall, facing +z; one ball per joint, half way to its first child (beyond the
// joint for leaves), bound to that joint.
Puppet MakePuppet();

// The puppet in another pose: global rotations from the T-pose, one per joint; the pelvis stays.
Puppet Pose(const Puppet& puppet, const std::vector<Rotation>& global);

// Random global rotations within `angle` radians per joint relative to its parent, about random axes.
std::vector<Rotation> RandomPose(uint64_t seed, double angle);

}  // namespace stance::testing
