// Characters as paper A's networks see them in training. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <vector>

#include "core/mesh/resample.h"
#include "core/network/tensors.h"
#include "core/training/character_generator.h"

namespace stance {

// B characters as the networks see them, with what the losses compare to.
struct TrainingBatch {
  PointBatch input;
  torch::Tensor joint_of;  // (N) int64, the joint of the largest true weight
  torch::Tensor joints;    // (B, 24, 3) normalised as the points are

  TrainingBatch To(torch::Device device) const;
};

struct SampleOptions {
  uint64_t seed = 1;
  int64_t samples = 1024;  // points per character
  int max_ring = 12;
  Split split = Split::kTrain;
  PoseMix poses = PoseMix::kTraining;
  bool augment = true;       // noise, per-limb scale, random resolution, holes
  bool turn = true;          // CharacterOptions::global_rotation
  double rigged_share = 0;   // CharacterOptions::rigged_share
  InputFeatures features{};  // of METHOD_STANCE's networks
};

// How the index-th character of the stream, or both of its pair, is to be scaled and roughened.
CharacterOptions TrainingCharacterOptions(const SampleOptions& options, int64_t index);

// The index-th character of the stream, posed, scaled and roughened as the options say.
Character MakeTrainingCharacter(const CharacterGenerator& generator, const SampleOptions& options,
                                int64_t index);

// (N) the joint of the largest weight at each sample's place.
std::vector<int32_t> LabelsOfSamples(const Character& character, const SurfaceSamples& samples);

// The batch of characters first .. first + size - 1 of the stream: the same arguments give the same batch.
TrainingBatch MakeTrainingBatch(const CharacterGenerator& generator, const SampleOptions& options,
                                int64_t first, int64_t size);

}  // namespace stance
