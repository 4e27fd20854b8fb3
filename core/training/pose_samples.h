// Characters as METHOD_STANCE's network sees them in training. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/random.h"
#include "core/network/pose_model.h"
#include "core/network/tensors.h"
#include "core/training/reuse_window.h"
#include "core/training/sample_stream.h"

namespace stance {

// One character, with what the losses compare to.
struct PoseSample {
  PyramidInput input;
  RowMatrix weights;                // (N, 24) true, rows sum to 1
  Points canonical;                 // (N, 3), Character::canonical
  Points joints;                    // (24, 3), as the points are
  Points bones;                     // (24, 3) from the parent to the joint in the rest pose; zero at the root
  std::vector<Rotation> rotations;  // (24), Character::rotations
  // What the first network finds in it, where the one that refines is trained.
  std::optional<PoseEstimate> first{};
};

// B characters as they stand, where the network sees them unposed; all in the unit of its input.
struct PosedBatch {
  torch::Tensor points;     // (N, 3)
  torch::Tensor joints;     // (B, 24, 3) true
  torch::Tensor rotations;  // (B, 24, 3, 3) true
  // Joint j at x in the network's input stands at turns_j x + shifts_j and turns by turns_j more.
  torch::Tensor turns;   // (B, 24, 3, 3)
  torch::Tensor shifts;  // (B, 24, 3)
};

// B characters as the network sees them.
struct PoseBatch {
  PyramidBatch input;
  torch::Tensor weights;              // (N, 24)
  torch::Tensor canonical;            // (N, 3)
  torch::Tensor joints;               // (B, 24, 3) normalised as the points are
  torch::Tensor bones;                // (B, 24, 3) in the same unit
  torch::Tensor rotations;            // (B, 24, 3, 3)
  std::optional<PosedBatch> posed{};  // of unposed ones

  PoseBatch To(torch::Device device) const;
};

// The sample as a mirror in the plane x = 0 shows it: left is right.
PoseSample Mirrored(const PoseSample& sample);

// The sample turned about the origin.
PoseSample Turned(PoseSample sample, const Rotation& turn);

// The sample as the network that refines sees it: unposed by `first` (pose_refinement.h), and what that makes
// of the true joints and rotations. REQUIRES: sample.first.
PoseSample Unposed(const PoseSample& sample);

// The estimate, each joint turned by angles and moved by lengths of deviations that are themselves random: so
// that a character unposed twice is not the same twice.
PoseEstimate Perturbed(PoseEstimate estimate, Random& random);

// How training turns a character: as the generator turns those of tests (SampleGlobalTurn), or, one in seven,
// anyhow, since people also lie down and stand on their hands.
Rotation TrainingTurn(Random& random);

// An endless stream of samples in which each character comes `reuse` times on average, turned and mirrored
// anew each time (reuse_window.h, about 1 GB at 1,024 samples): to make one costs far more than to turn it.
// The same arguments give the same samples. Thread-safe.
class PoseStream {
 public:
  // `generator` and `first` outlive the stream. With `first`, a model whose first network is trained, the
  // samples are unposed by what it finds, perturbed, instead of turned.
  PoseStream(const CharacterGenerator& generator, const SampleOptions& options, int64_t reuse,
             const PoseModel* first = nullptr);

  // The samples first .. first + size - 1.
  PoseBatch MakeBatch(int64_t first, int64_t size);

 private:
  PoseSample MakeSample(int64_t character) const;
  PoseSample At(int64_t index);

  const CharacterGenerator& generator_;
  const SampleOptions options_;
  const PoseModel* const first_;
  ReuseWindow<PoseSample> characters_;
};

}  // namespace stance
