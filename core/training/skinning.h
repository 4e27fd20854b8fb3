// Linear blend skinning for the generator's characters.
#pragma once

#include <vector>

#include "core/base/types.h"
#include "core/skeleton/kinematics.h"

namespace stance {

// Row v of the result is sum_j weights(v, j) * transforms[j].Apply(points.row(v)).
// REQUIRES: weights (V, J) with points (V, 3) and J transforms. Cost: the non-zero weights.
Points SkinPoints(const Points& points, const RowMatrix& weights,
                  const std::vector<AffineTransform>& transforms);

// The joints (J, 3) where `transforms` carry them.
Points TransformJoints(const Points& joints, const std::vector<AffineTransform>& transforms);

}  // namespace stance
