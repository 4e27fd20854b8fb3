// All that METHOD_STANCE finds in a mesh's samples: a network's looks at them, averaged, fitted and refined.
#pragma once

#include <span>
#include <vector>

#include "core/network/pose_model.h"

namespace stance {

struct PoseEstimationOptions {
  int views = 4;  // of each mesh, whose estimates are averaged (pose_views.h); 8 are no better
  // Of the second look (pose_refinement.h), at models that have one; they all face the same way: 2 are the
  // body and its mirror image. 0: no second look.
  int refinement_views = 2;
  // Of the mean confidence of the first look's joints: a mesh that gets less is looked at on its other sides,
  // too, and the look that is surest of itself counts. Networks trained on people who stand fail on those who
  // don't, and know it. 0: never.
  float least_confidence = 0.85f;
  // FitJoints'. 0.5 was the best of 0, 0.3, 0.5, 1, 2 and 3 on moderate and hard pairs.
  float joint_stiffness = 0.5f;
};

// One estimate per input, in order; each is the same as if it were alone. INTERNAL if Torch fails.
absl::StatusOr<std::vector<PoseEstimate>> EstimatePoses(const PoseModel& model,
                                                        std::span<const PyramidInput> inputs, int threads,
                                                        const PoseEstimationOptions& options = {});

}  // namespace stance
