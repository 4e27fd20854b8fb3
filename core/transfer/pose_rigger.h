// Rigs meshes by METHOD_STANCE's network.
#pragma once

#include "core/network/pose_model.h"
#include "core/transfer/parts.h"
#include "core/transfer/pose_estimation.h"

namespace stance {

// Samples each mesh evenly and lets the network weigh the samples and find the joints and their rotations
// from the rest pose (pose_estimation.h). A vertex has the weights of the sample whose geodesic Voronoi cell
// it lies in; ScreenedSmoother makes smooth ones of what Rig::sampled keeps. Confidences are calibrated as
// the model's manifest says.
class PoseRigger : public Rigger {
 public:
  // The model must outlive the rigger. `threads`: most that one call uses.
  PoseRigger(const PoseModel& model, int threads, const PoseEstimationOptions& options = {})
      : model_(model), threads_(threads), options_(options) {}

  absl::StatusOr<std::vector<Rig>> RigMeshes(std::span<const TriangleMesh* const> meshes,
                                             PhaseSeconds& seconds) const override;
  const Skeleton& skeleton() const override { return HumanSkeleton(); }

 private:
  const PoseModel& model_;
  const int threads_;
  const PoseEstimationOptions options_;
};

}  // namespace stance
