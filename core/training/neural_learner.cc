// Paper B's stages (section 4): the rigging branch, the transfer branch on what the first has learned, then
// both.
#include <utility>

#include "core/network/product.h"
#include "core/network/rigging_branch.h"
#include "core/network/transfer_branch.h"
#include "core/training/learner.h"
#include "core/training/neural_loss.h"
#include "core/training/neural_samples.h"

namespace stance {
namespace {

// L = alpha L_s + beta L_c + gamma L_v + delta L_e (equation 15).
struct LossWeights {
  double alpha, beta, gamma, delta;
};

LossWeights LossWeightsOf(TrainingStage stage) {
  switch (stage) {
    case TrainingStage::kRigging:
      return {1, 1, 0, 0};
    case TrainingStage::kTransfer:
      return {0, 0, 1, 5e-4};
    default:
      return {0.1, 0.1, 1, 5e-4};
  }
}

class NeuralLearner : public Learner {
 public:
  NeuralLearner(const CharacterGenerator& generator, const TrainingOptions& options, RiggingBranch rigging)
      : options_(options),
        pairs_(generator, SampleOptionsOf(options), options.reuse),
        rigging_(std::move(rigging)) {
    if (options_.stage != TrainingStage::kTransfer) return;
    rigging_->to(torch::Device(options_.device));
    rigging_->eval();
  }

  NamedModules modules() const override {
    NamedModules modules;
    if (options_.stage != TrainingStage::kTransfer) modules.emplace_back("rigging", rigging_.ptr());
    if (options_.stage != TrainingStage::kRigging) modules.emplace_back("transfer", transfer_.ptr());
    return modules;
  }

  double weight_decay() const override { return 0; }

  void Start(int64_t seen) override {
    StartStream<NeuralBatch>(
        options_, seen, [this](int64_t first) { return pairs_.MakeBatch(first, options_.batch_size); },
        stream_);
  }

  TrainingStep Next(int64_t) override {
    const NeuralBatch batch = stream_->Next().To(options_.device);
    const Bfloat16Products products(options_.bfloat16);
    const LossWeights weights = LossWeightsOf(options_.stage);
    const bool rigs = options_.stage != TrainingStage::kTransfer;
    RiggingPrediction rig;
    {
      const torch::AutoGradMode gradient(rigs);
      rig = rigging_(batch.input);
    }
    TrainingStep step;
    step.accuracy =
        (rig.weights.argmax(1) == batch.weights.argmax(1)).to(torch::kFloat32).mean().item<double>();
    const auto joint_square = (rig.joints - batch.joints).square().sum(2);
    step.joint_mm = joint_square.detach().sqrt().mean().item<double>() * kMillimetresPerUnit;
    // Lengths count in metres, as in the paper: what the weights of the losses are for.
    constexpr double kSquareMetres = kMillimetresPerUnit * kMillimetresPerUnit * 1e-6;
    if (rigs) {
      step.loss = weights.alpha * SparseWeightLoss(rig.weights, batch.weights) +
                  weights.beta * kSquareMetres * joint_square.mean();  // equation 18
    }
    if (options_.stage == TrainingStage::kRigging) return step;

    const auto moved = Transfer(batch, rig);
    const auto square = (moved - batch.target).square().sum(1);
    const auto loss = kSquareMetres * (weights.gamma * square.mean() +  // equation 19
                                       weights.delta * EdgeLengthLoss(moved, batch.target, batch.edges));
    step.transfer_mm = square.detach().sqrt().mean().item<double>() * kMillimetresPerUnit;
    step.loss = rigs ? step.loss + loss : loss;
    return step;
  }

 private:
  // V_t at the sources' samples.
  torch::Tensor Transfer(const NeuralBatch& batch, const RiggingPrediction& rig) {
    const int64_t pairs = batch.pair_count(), rows = batch.source_rows();
    const auto features = transfer_->Pool(batch.input, rig.weights);
    const auto latents = transfer_->Latents(features.slice(0, 0, pairs), features.slice(0, pairs),
                                            rig.joints.slice(0, 0, pairs), rig.joints.slice(0, pairs));
    const std::vector<int64_t> offsets(batch.input.offsets.begin(), batch.input.offsets.begin() + pairs + 1);
    return transfer_->Decode(latents, rig.weights.slice(0, 0, rows), batch.input.points.slice(0, 0, rows),
                             offsets);
  }

  const TrainingOptions& options_;
  PairStream pairs_;
  RiggingBranch rigging_;
  TransferBranch transfer_;
  std::optional<BatchStream<NeuralBatch>> stream_;
};

}  // namespace

std::unique_ptr<Learner> MakeNeuralLearner(const CharacterGenerator& generator,
                                           const TrainingOptions& options, RiggingBranch rigging) {
  return std::make_unique<NeuralLearner>(generator, options, std::move(rigging));
}

}  // namespace stance
