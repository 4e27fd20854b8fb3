// The pose of METHOD_STANCE: learned rotations, corrected by the bones.
#pragma once

#include <optional>

#include "core/transfer/anatomical_limits.h"
#include "core/transfer/parts.h"

namespace stance {

// The joints' rotations from source to reference, R_ref R_src^T of the riggers' rotations from the rest pose,
// after each rig's own have been moved towards those that carry its bones at rest onto its bones as they
// are: at a joint with one child by the smallest rotation more, at a joint with several by the rotation that
// fits all of them and the learned one best. Since each rig has rest bones of its own, skeletons of different
// proportions need not end with parallel bones. Last, each rig's knees and elbows are kept from bending
// backwards (anatomical_limits.h). REQUIRES: both rigs have rotations and bones.
class LearnedRotationSolver : public PoseSolver {
 public:
  // `correction`: how far towards the bones, in [0, 1]: the joints' places err, too. All the way was the best
  // of 0.5, 0.75 and 1 on moderate and hard pairs, once the networks had been taught by rotations corrected
  // so (0.75 before that). `limit`: of the hinges, which only the human skeleton has;
  // none leaves them as they come.
  explicit LearnedRotationSolver(float correction = 1, std::optional<HingeLimit> limit = HingeLimit())
      : correction_(correction), limit_(limit) {}

  std::vector<Rotation> Solve(const Skeleton& skeleton, const TriangleMesh& source, const Rig& source_rig,
                              const TriangleMesh& reference, const Rig& reference_rig) const override;

 private:
  std::vector<Rotation> Corrected(const Skeleton& skeleton, const Rig& rig) const;

  const float correction_;
  const std::optional<HingeLimit> limit_;
};

}  // namespace stance
