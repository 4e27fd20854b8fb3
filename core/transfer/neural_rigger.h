// Rigs meshes by paper B's networks.
#pragma once

#include "core/network/neural_model.h"
#include "core/transfer/parts.h"

namespace stance {

// Samples each mesh evenly and lets the networks weigh the samples, find the joints, and describe each joint
// to NeuralDeformer (Rig::features). A vertex has the weights of the sample whose geodesic Voronoi cell it
// lies in; ScreenedSmoother makes smooth ones of what Rig::sampled keeps.
class NeuralRigger : public Rigger {
 public:
  // The model must outlive the rigger. `threads`: most that one call uses.
  NeuralRigger(const NeuralModel& model, int threads) : model_(model), threads_(threads) {}

  absl::StatusOr<std::vector<Rig>> RigMeshes(std::span<const TriangleMesh* const> meshes,
                                             PhaseSeconds& seconds) const override;
  const Skeleton& skeleton() const override { return HumanSkeleton(); }

 private:
  const NeuralModel& model_;
  const int threads_;
};

}  // namespace stance
