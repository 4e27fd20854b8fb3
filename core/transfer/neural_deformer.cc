#include "core/transfer/neural_deformer.h"

#include "core/base/check.h"

namespace stance {
namespace {

NeuralCharacter CharacterOf(const Rig& rig) {
  STANCE_CHECK(rig.features.rows() == rig.joints.rows() && rig.sampled != nullptr);
  return {rig.features, rig.joints, NormalizationOf(rig.sampled->samples.points)};
}

}  // namespace

absl::StatusOr<Points> NeuralDeformer::Deform(const Points& vertices, const RowMatrix& weights,
                                              const Rig& source, const Rig& reference, int threads) const {
  return model_.Deform(CharacterOf(source), CharacterOf(reference), vertices, weights, threads);
}

}  // namespace stance
