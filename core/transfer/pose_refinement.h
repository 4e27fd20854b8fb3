// A second look at a mesh, bent back to its rest pose by the first: bodies then stand alike, and what is left
// to find is small.
#pragma once

#include <vector>

#include "core/network/pose_model.h"
#include "core/network/pyramid_input.h"

namespace stance {

// The rest-pose places (24, 3) of an estimate's joints: its bones end to end, the root at the origin.
Points RestJoints(const Points& bones);

// The input bent back to the rest pose by the estimate: linear blend skinning (paper A, equation 10) with
// the transforms x -> R_j^T (x - joint_j) + rest_j, in the canonical frame. Neighbourhoods stay as they are:
// they lie along the surface. REQUIRES: the estimate is of this input.
PyramidInput UnposedInput(const PyramidInput& input, const PoseEstimate& estimate);

// The joints' transforms (24) from the unposed input's frame back to the input's own.
std::vector<AffineTransform> PoseAgain(const PoseEstimate& first);

// What was seen in the unposed input, as an estimate of the input itself.
PoseEstimate EstimateBehindUnposing(PoseEstimate seen, const PoseEstimate& first);

}  // namespace stance
