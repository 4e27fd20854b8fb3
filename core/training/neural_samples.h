// Pairs of characters as METHOD_NEURAL's branches see them in training. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>

#include "core/network/tensors.h"
#include "core/training/reuse_window.h"
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

// A character of a pair, in metres.
struct PairSide {
  NetworkInput input;
  RowMatrix weights;  // (N, 24)
  Points joints;      // (24, 3)
};

// Source and reference differ in identity, pose and resolution (CharacterGenerator::MakePair); the target is
// exact.
struct NeuralPair {
  PairSide source, reference;
  Points target;  // (N of the source, 3)
};

// The pair as a mirror in the plane x = 0 shows it: left is right.
NeuralPair Mirrored(const NeuralPair& pair);

// Source and reference turned about the origin, each by a turn of its own. The target, which turns about the
// source's pelvis as the reference does, goes where that belongs.
NeuralPair Turned(NeuralPair pair, const Rotation& source, const Rotation& reference);

// An endless stream of pairs in which each comes `reuse` times on average, mirrored and its sides turned anew
// each time (reuse_window.h, about 2 GB at 1,024 samples); with a reuse of 1 as the generator makes them. The
// noise that options.augment asks for moves the reference's vertices and the source's samples, along their
// normals; the target has none. The same arguments give the same pairs. Thread-safe.
class PairStream {
 public:
  // `generator` outlives the stream.
  PairStream(const CharacterGenerator& generator, const SampleOptions& options, int64_t reuse);

  // The pairs first .. first + size - 1.
  NeuralBatch MakeBatch(int64_t first, int64_t size);

 private:
  NeuralPair MakePair(int64_t number) const;
  NeuralPair At(int64_t index);

  const CharacterGenerator& generator_;
  const SampleOptions options_;
  const int64_t reuse_;
  ReuseWindow<NeuralPair> pairs_;
};

}  // namespace stance
