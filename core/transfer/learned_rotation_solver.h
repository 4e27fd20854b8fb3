// The pose of METHOD_STANCE: learned rotations, corrected by the bones.
#pragma once

#include "core/transfer/parts.h"

namespace stance {

// The joints' rotations from source to reference, R_ref R_src^T of the riggers' rotations from the rest pose;
// then, at each joint with one child, the smallest rotation more that makes the source's bone point as the
// reference's does, and at each joint with several children the rotation that fits all its bones (paper A,
// equation 7) and, in what they leave open, the learned one. REQUIRES: both rigs have rotations.
class LearnedRotationSolver : public PoseSolver {
 public:
  std::vector<Rotation> Solve(const Skeleton& skeleton, const TriangleMesh& source, const Rig& source_rig,
                              const TriangleMesh& reference, const Rig& reference_rig) const override;
};

}  // namespace stance
