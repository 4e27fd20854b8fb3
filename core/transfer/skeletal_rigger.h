// Rigs meshes by paper A's networks.
#pragma once

#include <memory>

#include "core/network/skeletal_model.h"
#include "core/transfer/parts.h"

namespace stance {

// Samples each mesh evenly (or takes its vertices, with full_resolution), lets f_C bind the samples rigidly
// and f_J place the joints, and gives every vertex the joint of its geodesic Voronoi cell: rigid weights (V,
// 24).
class SkeletalRigger : public Rigger {
 public:
  // The model must outlive the rigger. `threads`: most that one call uses.
  SkeletalRigger(const SkeletalModel& model, int threads, bool full_resolution)
      : model_(model), threads_(threads), full_resolution_(full_resolution) {}

  absl::StatusOr<std::vector<Rig>> RigMeshes(std::span<const TriangleMesh* const> meshes,
                                             PhaseSeconds& seconds) const override;
  const Skeleton& skeleton() const override { return HumanSkeleton(); }

 private:
  const SkeletalModel& model_;
  const int threads_;
  const bool full_resolution_;
};

}  // namespace stance
