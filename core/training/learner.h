// What a training stage teaches: its networks, its batches and its losses. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/training/character_generator.h"
#include "core/training/trainer.h"

namespace stance {

using NamedModules = std::vector<std::pair<std::string, std::shared_ptr<torch::nn::Module>>>;

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

// `generator` and `options` outlive the learner.
std::unique_ptr<Learner> MakeSkeletalLearner(const CharacterGenerator& generator,
                                             const TrainingOptions& options);
std::unique_ptr<Learner> MakePoseLearner(const CharacterGenerator& generator, const TrainingOptions& options);

}  // namespace stance
