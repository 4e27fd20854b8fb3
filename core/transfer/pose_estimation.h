// All that METHOD_STANCE finds in samples of a mesh: the networks' looks at them, averaged, fitted and
// refined.
#pragma once

#include <span>
#include <vector>

#include "core/network/pose_model.h"

namespace stance {

struct PoseEstimationOptions {
  // Of a mesh's surface, taken by PoseRigger. What is estimated from each errs on its own by where its
  // samples happen to lie, so that their mean errs less: rotations by an eighth, joints by a seventh, than
  // one sampling's in four views; 6 are 3 % better than 4 and take half as long again.
  int samplings = 4;
  int views = 1;  // of each sampling in the first look; in all, they are turned evenly (pose_views.h)
  // Of each sampling in the second look (pose_refinement.h), at models that have one; they all face the same
  // way, by turns the body and its mirror image. 0: no second look.
  int refinement_views = 1;
  // Of the mean confidence of the first look's joints: a mesh that gets less is looked at on its other sides,
  // too, and the look that is surest of itself counts. Networks trained on people who stand fail on those who
  // don't, and know it. 0: never.
  float least_confidence = 0.85f;
  // FitJoints'. 0.5 was the best of 0, 0.3, 0.5, 1, 2 and 3 on moderate and hard pairs.
  float joint_stiffness = 0.5f;
};

// One mesh: samplings of its surface, at least one.
using Samplings = std::vector<PyramidInput>;

// One estimate per mesh, in order, the same as if it were alone; its weights and places are those of all its
// samplings' samples, in order. INTERNAL if Torch fails.
absl::StatusOr<std::vector<PoseEstimate>> EstimatePoses(const PoseModel& model,
                                                        std::span<const Samplings> meshes, int threads,
                                                        const PoseEstimationOptions& options = {});

}  // namespace stance
