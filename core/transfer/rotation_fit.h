// The joints' rotations behind a deformation that knows none.
#pragma once

#include <vector>

#include "core/skeleton/kinematics.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// What a skinned surface was, and what became of it.
struct DeformedSurface {
  const Points& from;           // (V, 3)
  const Points& to;             // (V, 3), the same vertices
  const RowMatrix& weights;     // (V, J), rows sum to 1
  const Eigen::VectorXd& mass;  // (V) >= 0, what each vertex counts for: its share of the area
};

// (J) each joint's global rotation, from -> to: the one that minimises sum_v mass_v W_vj |R (from_v - a_j) -
// (to_v - b_j)|^2 about the weighted means a_j and b_j, with a small pull towards the parent's rotation,
// which decides where the joint's vertices leave it open (too few, or all in a line) and alone where it has
// none.
std::vector<Rotation> FitRotations(const Skeleton& skeleton, const DeformedSurface& surface);

}  // namespace stance
