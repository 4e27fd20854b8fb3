// The human skeleton as a mirror in the plane x = 0 shows it: left is right.
#pragma once

#include <vector>

#include "core/skeleton/kinematics.h"

namespace stance {

// Rotations (24), local or global.
std::vector<Rotation> MirroredRotations(const std::vector<Rotation>& rotations);

// Joints or bones (24, 3).
Points MirroredJoints(const Points& joints);

// Weights (N, 24) of points that stay where they are.
RowMatrix MirroredWeights(const RowMatrix& weights);

}  // namespace stance
