// Pairs of characters as METHOD_NEURAL's branches see them in training. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>

#include "core/network/tensors.h"
#include "core/training/sample_stream.h"

namespace stance {

// B pairs: the meshes 0 .. B - 1 are the sources, B .. 2B - 1 their references.
struct NeuralBatch {
  PointBatch input;
  torch::Tensor weights;  // (N, 24) true, rows sum to 1
  torch::Tensor joints;   // (2B, 24, 3) true, each normalised as its own mesh's points are
  torch::Tensor target;   // (N of the sources, 3) where their points belong in the references' poses,
                          // normalised as the source's points are
  torch::Tensor edges;  // (E, 2) int64 rows of the sources' points: samples whose cells touch, each pair once

  int64_t pair_count() const { return input.mesh_count() / 2; }
  int64_t source_rows() const { return input.offsets[pair_count()]; }
  NeuralBatch To(torch::Device device) const;
};

// The pairs first .. first + size - 1 of the stream (CharacterGenerator::MakePair): source and reference
// differ in identity, pose and resolution, and the target is exact. The noise that options.augment asks for
// moves the reference's vertices and the source's samples, along their normals; the target has none. The same
// arguments give the same batch.
NeuralBatch MakeNeuralBatch(const CharacterGenerator& generator, const SampleOptions& options, int64_t first,
                            int64_t size);

}  // namespace stance
