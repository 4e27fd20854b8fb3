#include "core/network/skeletal_model.h"

#include <ATen/Parallel.h>
#include <fmt/format.h>

#include <cstring>

#include "core/network/model_files.h"
#include "core/network/skeletal_networks.h"

namespace stance {

struct SkeletalModel::Networks {
  WeightNetwork weights;
  JointNetwork joints;
  torch::Device device = torch::cuda::is_available() ? torch::kCUDA : torch::kCPU;
};

SkeletalModel::SkeletalModel() : networks_(std::make_unique<Networks>()) {}
SkeletalModel::~SkeletalModel() = default;

absl::StatusOr<std::unique_ptr<SkeletalModel>> SkeletalModel::Load(const std::filesystem::path& dir) {
  try {
    STANCE_ASSIGN_OR_RETURN(ModelManifest manifest, ReadManifest(dir));
    if (manifest.method != kSkeletalMethod) {
      return absl::InvalidArgumentError(fmt::format("{}: the model is of the method '{}', not '{}'",
                                                    dir.string(), manifest.method, kSkeletalMethod));
    }
    STANCE_ASSIGN_OR_RETURN(const TensorMap tensors, ReadWeights(dir, manifest));
    std::unique_ptr<SkeletalModel> model(new SkeletalModel);
    for (const auto& status : {LoadModule(*model->networks_->weights, kWeightNetworkPrefix, tensors),
                               LoadModule(*model->networks_->joints, kJointNetworkPrefix, tensors)}) {
      if (!status.ok()) {
        return absl::InvalidArgumentError(
            fmt::format("{}: {}", (dir / manifest.weights).string(), std::string(status.message())));
      }
    }
    model->manifest_ = std::move(manifest);
    for (torch::nn::Module* module : {static_cast<torch::nn::Module*>(model->networks_->weights.get()),
                                      static_cast<torch::nn::Module*>(model->networks_->joints.get())}) {
      module->eval();
      module->to(model->networks_->device);
    }
    return model;
  } catch (const std::exception& error) {  // Torch's wall
    return absl::InternalError(fmt::format("{}: {}", dir.string(), error.what()));
  }
}

absl::Status SkeletalModel::WriteUntrained(const std::filesystem::path& dir, uint64_t seed,
                                           const ModelManifest& manifest) {
  torch::manual_seed(seed);
  const WeightNetwork weights;
  const JointNetwork joints;
  TensorMap tensors = ModuleTensors(*weights, kWeightNetworkPrefix, /*half=*/true);
  tensors.merge(ModuleTensors(*joints, kJointNetworkPrefix, /*half=*/true));
  return WriteModel(dir, manifest, tensors);
}

int64_t SkeletalModel::parameter_count() const {
  return ParameterCount(*networks_->weights) + ParameterCount(*networks_->joints);
}

absl::StatusOr<std::vector<SkeletalPrediction>> SkeletalModel::Infer(std::span<const NetworkInput> inputs,
                                                                     int threads) const {
  std::vector<SkeletalPrediction> predictions(inputs.size());
  if (inputs.empty()) return predictions;
  try {
    torch::InferenceMode inference;
    // OpenMP keeps a team per calling thread: the setting is this thread's own.
    at::set_num_threads(threads);
    const PointBatch batch = StackInputs(inputs, networks_->device);
    const auto logits = networks_->weights->forward(batch);
    const auto joints = networks_->joints->forward(batch, RigidWeights(logits)).cpu();
    const auto confidence = torch::softmax(logits, 1).cpu();
    const auto joint_of = logits.argmax(1).to(torch::kInt32).cpu();
    for (size_t mesh = 0; mesh < inputs.size(); ++mesh) {
      const int64_t first = batch.offsets[mesh], count = batch.offsets[mesh + 1] - first;
      SkeletalPrediction& prediction = predictions[mesh];
      const int32_t* labels = joint_of.data_ptr<int32_t>() + first;
      prediction.joint_of.assign(labels, labels + count);
      prediction.confidence = Eigen::Map<const RowMatrix>(confidence.data_ptr<float>() + first * kHumanJoints,
                                                          count, kHumanJoints);
      const Eigen::Map<const Points> normalized(joints.data_ptr<float>() + mesh * kHumanJoints * 3,
                                                kHumanJoints, 3);
      prediction.joints = NormalizationOf(inputs[mesh].points).Invert(normalized);
    }
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("network: {}", error.what()));
  }
  return predictions;
}

}  // namespace stance
