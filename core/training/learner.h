// What a training stage teaches: its networks, its batches and its losses. Includes Torch.
#pragma once

#include <ATen/Parallel.h>
#include <torch/torch.h>

#include <memory>
#include <optional>
#include <vector>

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
  double accuracy = 0;  // fraction of samples with the right joint; 0 where none are learned
  double joint_mm = 0;  // mean joint error; 0 where none are learned
  double degrees = 0;   // mean rotation error; 0 where none are learned
};

// Not thread-safe.
class Learner {
 public:
  virtual ~Learner() = default;

  // The networks, named as in the checkpoint.
  virtual NamedModules modules() const = 0;
  virtual std::unique_ptr<torch::optim::Optimizer> MakeOptimizer(const std::vector<torch::Tensor>& parameters,
                                                                 double learning_rate) const = 0;
  // Begins to make batches, from the character `seen` on.
  virtual void Start(int64_t seen) = 0;
  // The losses on the next batch. REQUIRES: Start was called, with `seen` characters before this batch.
  virtual TrainingStep Next(int64_t seen) = 0;
};

// Begins to make the stage's batches, from the character `seen` on; each stage sees its own characters.
// `make` is MakeTrainingBatch or its like. `generator` and `options` outlive the stream.
template <typename Batch>
void StartStream(const CharacterGenerator& generator, const TrainingOptions& options, int64_t seen,
                 Batch (*make)(const CharacterGenerator&, const SampleOptions&, int64_t, int64_t),
                 std::optional<BatchStream<Batch>>& stream) {
  const SampleOptions samples{options.seed * 3 + static_cast<uint64_t>(options.stage),
                              options.samples_per_mesh, options.max_ring};
  stream.emplace(
      [&generator, &options, samples, make](int64_t first) {
        at::set_num_threads(1);
        return make(generator, samples, first, options.batch_size);
      },
      seen, options.batch_size, options.generator_threads);
}

// `generator` and `options` outlive the learner.
std::unique_ptr<Learner> MakeSkeletalLearner(const CharacterGenerator& generator,
                                             const TrainingOptions& options);
std::unique_ptr<Learner> MakePoseLearner(const CharacterGenerator& generator, const TrainingOptions& options);

}  // namespace stance
