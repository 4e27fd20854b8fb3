// What a training stage teaches: its networks, its batches and its losses. Includes Torch.
#pragma once

#include <ATen/Parallel.h>
#include <torch/torch.h>

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/network/pose_model.h"
#include "core/network/rigging_branch.h"
#include "core/training/batch_stream.h"
#include "core/training/character_generator.h"
#include "core/training/checkpoint.h"
#include "core/training/sample_stream.h"
#include "core/training/trainer.h"

namespace stance {

// A normalised length as millimetres of a 1.7 m character, which standing with its arms down has a
// bounding-box diagonal of about 1.8 m.
inline constexpr double kMillimetresPerUnit = 1800;

struct TrainingStep {
  torch::Tensor loss;
  double accuracy = 0;     // fraction of samples with the right joint; 0 where none are learned
  double joint_mm = 0;     // mean joint error; 0 where none are learned
  double degrees = 0;      // mean rotation error; 0 where none are learned
  double transfer_mm = 0;  // mean error of a transfer to the next character; 0 where none is learned
};

// Not thread-safe.
class Learner {
 public:
  virtual ~Learner() = default;

  // The networks, named as in the checkpoint.
  virtual NamedModules modules() const = 0;
  virtual double weight_decay() const = 0;  // AdamW's
  // Begins to make batches, from the character `seen` on.
  virtual void Start(int64_t seen) = 0;
  // The losses on the next batch. REQUIRES: Start was called, with `seen` characters before this batch.
  virtual TrainingStep Next(int64_t seen) = 0;
};

// What the stage's stream of characters is asked for; each stage sees its own characters.
inline SampleOptions SampleOptionsOf(const TrainingOptions& options) {
  SampleOptions samples{options.seed * 3 + static_cast<uint64_t>(options.stage), options.samples_per_mesh,
                        options.max_ring};
  samples.rigged_share = options.rigged_share;
  samples.features = options.features;
  return samples;
}

// Begins to make the stage's batches by `make(first)`, from the character `seen` on.
template <typename Batch>
void StartStream(const TrainingOptions& options, int64_t seen, std::function<Batch(int64_t)> make,
                 std::optional<BatchStream<Batch>>& stream) {
  stream.emplace(
      [make = std::move(make)](int64_t first) {
        at::set_num_threads(1);
        return make(first);
      },
      seen, options.batch_size, options.generator_threads);
}

// `generator` and `options` outlive the learner.
std::unique_ptr<Learner> MakeSkeletalLearner(const CharacterGenerator& generator,
                                             const TrainingOptions& options);
// With `first`, of the stage "refinement": the model whose first network unposes the characters.
std::unique_ptr<Learner> MakePoseLearner(const CharacterGenerator& generator, const TrainingOptions& options,
                                         std::unique_ptr<const PoseModel> first = nullptr);
// `rigging`: of the stage "transfer", the branch as the stage before has left it; otherwise where it begins.
std::unique_ptr<Learner> MakeNeuralLearner(const CharacterGenerator& generator,
                                           const TrainingOptions& options,
                                           RiggingBranch rigging = RiggingBranch());

}  // namespace stance
