// The stage "pose": weights, rest-pose coordinates, joints, rotations and confidences at once. The stage
// "refinement": the same of characters that the first network's estimates have bent back to rest.

#include <numbers>

#include "core/network/pose_model.h"
#include "core/network/pose_network.h"
#include "core/network/product.h"
#include "core/training/learner.h"
#include "core/training/pose_samples.h"
#include "core/training/transfer_error.h"

namespace stance {
namespace {

// Angles between rotations (..., 3, 3), radians.
torch::Tensor Angles(const torch::Tensor& a, const torch::Tensor& b) {
  return ((a * b).sum({-2, -1}) - 1).div(2).clamp(-1, 1).acos();
}

class PoseLearner : public Learner {
 public:
  PoseLearner(const CharacterGenerator& generator, const TrainingOptions& options,
              std::unique_ptr<const PoseModel> first)
      : options_(options),
        first_(std::move(first)),
        characters_(generator, StreamSamples(options), options.reuse, first_.get()) {}

  NamedModules modules() const override { return {{"pose", network_.ptr()}}; }

  double weight_decay() const override { return 1e-4; }

  void Start(int64_t seen) override {
    StartStream<PoseBatch>(
        options_, seen,
        [this](int64_t first) {
          const Bfloat16Products products(options_.bfloat16);  // of the first network, where there is one
          return characters_.MakeBatch(first, options_.batch_size);
        },
        stream_);
  }

  TrainingStep Next(int64_t seen) override {
    const PoseBatch batch = stream_->Next().To(options_.device);
    const Bfloat16Products products(options_.bfloat16);
    const PosePrediction out = network_(batch.input, PoolWeights(batch, seen));
    const auto log_weights = torch::log_softmax(out.logits, 1);
    const auto weights = torch::kl_div(log_weights, batch.weights).mul(kHumanJoints);  // per sample
    const auto length = [](const torch::Tensor& v) { return (v.square().sum(-1) + 1e-8).sqrt(); };
    const auto joint_error = length(out.joints - batch.joints);
    // The square is flat near the truth, the length is not.
    const auto rotation_square = (out.rotations - batch.rotations).square().sum({-2, -1});
    const auto rotation_loss = 0.5 * rotation_square + (rotation_square + 1e-6).sqrt();
    const auto angles = Angles(out.rotations.detach(), batch.rotations);
    const auto right = (angles < kRightAngle).logical_and(joint_error.detach() < kRightDistance);
    const auto transfer = TransferError(batch, out);
    const auto confidence =
        torch::binary_cross_entropy_with_logits(out.confidence, right.to(torch::kFloat32));
    TrainingStep step;
    step.loss = weights + kCanonical * length(out.canonical - batch.canonical).mean() +
                kBones * length(out.bones - batch.bones).mean() +
                kJoints * (joint_error.mean() + kRoot * joint_error.select(1, 0).mean()) +
                kRotations * rotation_loss.mean() + kTransfer * transfer + kConfidence * confidence;
    step.accuracy =
        (out.logits.argmax(1) == batch.weights.argmax(1)).to(torch::kFloat32).mean().item<double>();
    step.joint_mm = joint_error.mean().item<double>() * kMillimetresPerUnit;
    step.transfer_mm = transfer.item<double>() * kMillimetresPerUnit;
    step.degrees = angles.mean().item<double>() * 180 / std::numbers::pi;
    return step;
  }

 private:
  // The weights of the losses, from the scales on which each is about as hard to lower.
  static constexpr double kCanonical = 5, kJoints = 10, kBones = 20, kRotations = 0.5, kTransfer = 20,
                          kConfidence = 0.1;
  static constexpr double kCorrection = 1;  // LearnedRotationSolver's
  // Of the pelvis beyond its part of all the joints: a body turns about it, so that its error shifts all.
  static constexpr double kRoot = 0.2;
  // What "right" means to the confidence (pose_model.h), radians and normalised.
  static constexpr double kRightAngle = kRightDegrees * std::numbers::pi / 180,
                          kRightDistance = kRightMillimetres / kMillimetresPerUnit;

  // Early on, features are pooled by the true weights in half of the batches, so that the joints learn from
  // the beginning; less and less often over the first quarter. Trained networks have no need of it.
  torch::Tensor PoolWeights(const PoseBatch& batch, int64_t seen) const {
    if (first_ || !options_.start_from.empty()) return {};
    const double done = static_cast<double>(seen) / static_cast<double>(options_.total_samples);
    const double share = std::max(0.0, 0.5 - 2 * done);
    Random random(options_.seed, static_cast<uint64_t>(seen));
    return random.Uniform(0, 1) < share ? batch.weights : torch::Tensor();
  }

  // The mean over all points, of the characters as they stand. The last look's rotations are those that the
  // pose solver will correct; the first's are used as they are, and learn slowly if only corrected ones
  // count.
  static torch::Tensor TransferError(const PoseBatch& batch, const PosePrediction& out) {
    RigBatch found = {torch::softmax(out.logits, 1), out.joints, out.rotations};
    RigBatch truth = {batch.weights, batch.joints, batch.rotations};
    if (batch.posed) {
      const PosedBatch& posed = *batch.posed;
      found.joints = torch::matmul(posed.turns, found.joints.unsqueeze(-1)).squeeze(-1) + posed.shifts;
      found.rotations = torch::matmul(posed.turns, found.rotations);
      truth.joints = posed.joints;
      truth.rotations = posed.rotations;
      found.rotations = CorrectedByBones(found.rotations, found.joints, out.bones, kCorrection);
    }
    const torch::Tensor& points = batch.posed ? batch.posed->points : batch.input.points;
    return TransferErrors(points, found, truth, batch.input.offsets[0]).mean();
  }

  static SampleOptions StreamSamples(const TrainingOptions& options) {
    SampleOptions samples = SampleOptionsOf(options);
    samples.turn = options.stage == TrainingStage::kRefinement;  // those of "pose" the stream turns
    return samples;
  }

  const TrainingOptions& options_;
  const std::unique_ptr<const PoseModel> first_;
  PoseNetwork network_;
  PoseStream characters_;
  std::optional<BatchStream<PoseBatch>> stream_;
};

}  // namespace

std::unique_ptr<Learner> MakePoseLearner(const CharacterGenerator& generator, const TrainingOptions& options,
                                         std::unique_ptr<const PoseModel> first) {
  return std::make_unique<PoseLearner>(generator, options, std::move(first));
}

}  // namespace stance
