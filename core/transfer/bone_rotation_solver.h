// Paper A's skeleton pose transfer (Algorithm 1).
#pragma once

#include "core/transfer/options.h"
#include "core/transfer/parts.h"

namespace stance {

// Rotations from bone directions alone: joints with several children by SVD (reflections fixed), with one
// child by Rodrigues' formula, leaves by a virtual child, the centroid of the vertices bound to them
// (equation 7).
//
// What the paper leaves open: parallel bones give the identity and opposite ones a half turn
// (SmallestRotation); a leaf without vertices, or whose centroid is the joint itself, follows its parent.
class BoneRotationSolver : public PoseSolver {
 public:
  explicit BoneRotationSolver(Twist twist) : twist_(twist) {}

  std::vector<Rotation> Solve(const Skeleton& skeleton, const TriangleMesh& source, const Rig& source_rig,
                              const TriangleMesh& reference, const Rig& reference_rig) const override;

 private:
  Twist twist_;
};

// Equation 7 for every joint: the mean of the vertices whose largest weight is the joint's; NaN where it has
// none.
Points VirtualChildren(const Points& vertices, const RowMatrix& weights);

}  // namespace stance
