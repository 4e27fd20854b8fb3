// Paper A's stages (section 3.1.4).
#include <ATen/CPUGeneratorImpl.h>

#include "core/network/skeletal_networks.h"
#include "core/training/learner.h"

namespace stance {
namespace {

// `count` random rows of each mesh. Drawn from `seed` alone, so that a resumed run repeats what an unbroken
// one would have done.
torch::Tensor RandomRows(const std::vector<int64_t>& offsets, int64_t count, uint64_t seed) {
  auto generator = at::detail::createCPUGenerator(seed);
  std::vector<torch::Tensor> rows;
  for (size_t mesh = 0; mesh + 1 < offsets.size(); ++mesh) {
    const int64_t size = offsets[mesh + 1] - offsets[mesh];
    rows.push_back(torch::randperm(size, generator, torch::kInt64).slice(0, 0, std::min(count, size)) +
                   offsets[mesh]);
  }
  return torch::cat(rows);
}

class SkeletalLearner : public Learner {
 public:
  SkeletalLearner(const CharacterGenerator& generator, const TrainingOptions& options)
      : generator_(generator), options_(options) {}

  NamedModules modules() const override {
    NamedModules modules;
    if (options_.stage != TrainingStage::kJoints) modules.emplace_back("f_c", weights_.ptr());
    if (options_.stage != TrainingStage::kWeights) modules.emplace_back("f_j", joints_.ptr());
    return modules;
  }

  double weight_decay() const override { return 0; }

  void Start(int64_t seen) override {
    StartStream<TrainingBatch>(
        options_, seen,
        [this](int64_t first) {
          return MakeTrainingBatch(generator_, SampleOptionsOf(options_), first, options_.batch_size);
        },
        stream_);
  }

  TrainingStep Next(int64_t seen) override {
    const TrainingBatch batch = stream_->Next().To(options_.device);
    TrainingStep step;
    torch::Tensor rigid;
    if (options_.stage != TrainingStage::kJoints) {
      // f_J needs a label for every point, f_C's loss only for some.
      torch::Tensor logits, target;
      if (options_.stage == TrainingStage::kBoth) {
        logits = weights_(batch.input);
        target = batch.joint_of;
        rigid = RigidWeights(logits.detach());
      } else {
        const auto rows =
            RandomRows(batch.input.offsets, options_.loss_points, options_.seed + static_cast<uint64_t>(seen))
                .to(batch.joint_of.device());
        logits = weights_->ForwardRows(batch.input, rows);
        target = batch.joint_of.index_select(0, rows);
      }
      step.loss = torch::nn::functional::cross_entropy(logits, target);  // equation 5
      step.accuracy = (logits.argmax(1) == target).to(torch::kFloat32).mean().item<double>();
    }
    if (options_.stage != TrainingStage::kWeights) {
      if (!rigid.defined()) rigid = torch::one_hot(batch.joint_of, kHumanJoints).to(torch::kFloat32);
      const auto difference = joints_(batch.input, rigid) - batch.joints;
      const auto loss = difference.square().sum(2).mean();  // equation 6, per joint
      step.joint_mm = difference.norm(2, 2).mean().item<double>() * kMillimetresPerUnit;
      // In "both" the weights keep most of the gradient's size: joints are 100 times smaller numbers.
      step.loss = step.loss.defined() ? step.loss + 100 * loss : loss;
    }
    return step;
  }

 private:
  const CharacterGenerator& generator_;
  const TrainingOptions& options_;
  WeightNetwork weights_;
  JointNetwork joints_;
  std::optional<BatchStream<TrainingBatch>> stream_;
};

}  // namespace

std::unique_ptr<Learner> MakeSkeletalLearner(const CharacterGenerator& generator,
                                             const TrainingOptions& options) {
  return std::make_unique<SkeletalLearner>(generator, options);
}

}  // namespace stance
