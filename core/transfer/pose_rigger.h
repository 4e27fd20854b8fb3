// Rigs meshes by METHOD_STANCE's network.
#pragma once

#include "core/network/pose_model.h"
#include "core/transfer/parts.h"

namespace stance {

// Samples each mesh evenly and lets the network weigh the samples and find the joints and their rotations
// from the rest pose, as the mean of what it finds in several views of the mesh (pose_views.h). A vertex has
// the weights of the sample whose geodesic Voronoi cell it lies in; ScreenedSmoother makes smooth ones of
// what Rig::sampled keeps. Confidences are calibrated as the model's manifest says.
class PoseRigger : public Rigger {
 public:
  static constexpr int kViews = 8;

  // The model must outlive the rigger. `threads`: most that one call uses.
  PoseRigger(const PoseModel& model, int threads, int views = kViews)
      : model_(model), threads_(threads), views_(views) {}

  absl::StatusOr<std::vector<Rig>> RigMeshes(std::span<const TriangleMesh* const> meshes,
                                             PhaseSeconds& seconds) const override;
  const Skeleton& skeleton() const override { return HumanSkeleton(); }

 private:
  const PoseModel& model_;
  const int threads_, views_;
};

}  // namespace stance
