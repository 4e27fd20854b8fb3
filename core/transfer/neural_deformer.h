// The deformation of METHOD_NEURAL: paper B's decoder in place of linear blend skinning.
#pragma once

#include "core/network/neural_model.h"
#include "core/transfer/parts.h"

namespace stance {

// Decodes each vertex by itself from its place and its weights' blend of the joints' latents (paper B,
// equations 11 to 14): any number of vertices. REQUIRES: both rigs are NeuralRigger's, of the same model.
class NeuralDeformer : public PairDeformer {
 public:
  // The model must outlive the deformer.
  explicit NeuralDeformer(const NeuralModel& model) : model_(model) {}

  absl::StatusOr<Points> Deform(const Points& vertices, const RowMatrix& weights, const Rig& source,
                                const Rig& reference, int threads) const override;

 private:
  const NeuralModel& model_;
};

}  // namespace stance
