// Characters as METHOD_STANCE's network sees them in training. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>

#include "core/network/tensors.h"
#include "core/training/sample_stream.h"

namespace stance {

// B characters with what the losses compare to.
struct PoseBatch {
  PyramidBatch input;
  torch::Tensor weights;    // (N, 24) true, rows sum to 1
  torch::Tensor canonical;  // (N, 3), Character::canonical
  torch::Tensor joints;     // (B, 24, 3) normalised as the points are
  torch::Tensor rotations;  // (B, 24, 3, 3), Character::rotations

  PoseBatch To(torch::Device device) const;
};

// The batch of characters first .. first + size - 1 of the stream: the same arguments give the same batch.
PoseBatch MakePoseBatch(const CharacterGenerator& generator, const SampleOptions& options, int64_t first,
                        int64_t size);

}  // namespace stance
