#include "core/network/neural_model.h"

#include <ATen/Parallel.h>
#include <fmt/format.h>

#include <utility>

#include "core/base/check.h"
#include "core/network/model_files.h"
#include "core/network/rigging_branch.h"
#include "core/network/transfer_branch.h"

namespace stance {
namespace {

template <typename Matrix>
torch::Tensor Tensor(const Matrix& matrix, torch::Device device) {
  torch::Tensor tensor = torch::empty({matrix.rows(), matrix.cols()});
  Eigen::Map<RowMatrix>(tensor.data_ptr<float>(), matrix.rows(), matrix.cols()) = matrix;
  return tensor.to(device);
}

}  // namespace

struct NeuralModel::Networks {
  RiggingBranch rigging;
  TransferBranch transfer;
  torch::Device device = torch::cuda::is_available() ? torch::kCUDA : torch::kCPU;
};

NeuralModel::NeuralModel() : networks_(std::make_unique<Networks>()) {}
NeuralModel::~NeuralModel() = default;

absl::StatusOr<std::unique_ptr<NeuralModel>> NeuralModel::Load(const std::filesystem::path& dir) {
  try {
    STANCE_ASSIGN_OR_RETURN(ModelManifest manifest, ReadManifest(dir));
    if (manifest.method != kNeuralMethod) {
      return absl::InvalidArgumentError(fmt::format("{}: the model is of the method '{}', not '{}'",
                                                    dir.string(), manifest.method, kNeuralMethod));
    }
    STANCE_ASSIGN_OR_RETURN(const TensorMap tensors, ReadWeights(dir, manifest));
    std::unique_ptr<NeuralModel> model(new NeuralModel);
    Networks& networks = *model->networks_;
    for (const auto& [prefix, module] :
         {std::pair<const char*, torch::nn::Module*>{kRiggingBranchPrefix, networks.rigging.get()},
          std::pair<const char*, torch::nn::Module*>{kTransferBranchPrefix, networks.transfer.get()}}) {
      if (const absl::Status status = LoadModule(*module, prefix, tensors); !status.ok()) {
        return absl::InvalidArgumentError(
            fmt::format("{}: {}", (dir / manifest.weights).string(), std::string(status.message())));
      }
      module->eval();
      module->to(networks.device);
    }
    model->manifest_ = std::move(manifest);
    return model;
  } catch (const std::exception& error) {  // Torch's wall
    return absl::InternalError(fmt::format("{}: {}", dir.string(), error.what()));
  }
}

absl::Status NeuralModel::WriteUntrained(const std::filesystem::path& dir, uint64_t seed,
                                         ModelManifest manifest) {
  torch::manual_seed(seed);
  const RiggingBranch rigging;
  const TransferBranch transfer;
  TensorMap tensors = ModuleTensors(*rigging, kRiggingBranchPrefix, /*half=*/true);
  tensors.merge(ModuleTensors(*transfer, kTransferBranchPrefix, /*half=*/true));
  manifest.method = kNeuralMethod;
  return WriteModel(dir, std::move(manifest), tensors);
}

int64_t NeuralModel::parameter_count() const {
  return ParameterCount(*networks_->rigging) + ParameterCount(*networks_->transfer);
}

absl::StatusOr<std::vector<NeuralRig>> NeuralModel::Infer(std::span<const NetworkInput> inputs,
                                                          int threads) const {
  std::vector<NeuralRig> rigs(inputs.size());
  if (inputs.empty()) return rigs;
  try {
    torch::InferenceMode inference;
    // OpenMP keeps a team per calling thread: the setting is this thread's own.
    at::set_num_threads(threads);
    const PointBatch batch = StackInputs(inputs, networks_->device);
    const RiggingPrediction out = networks_->rigging->forward(batch);
    const auto features = networks_->transfer->Pool(batch, out.weights).flatten(0, 1).cpu();
    const auto weights = out.weights.cpu(), joints = out.joints.flatten(0, 1).cpu();
    for (size_t mesh = 0; mesh < inputs.size(); ++mesh) {
      const int64_t first = batch.offsets[mesh], count = batch.offsets[mesh + 1] - first;
      const auto first_joint = static_cast<int64_t>(mesh) * kHumanJoints;
      NeuralRig& rig = rigs[mesh];
      rig.weights = RowsOf(weights, first, count);
      rig.joints = NormalizationOf(inputs[mesh].points).Invert(RowsOf(joints, first_joint, kHumanJoints));
      rig.features = RowsOf(features, first_joint, kHumanJoints);
    }
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("network: {}", error.what()));
  }
  return rigs;
}

absl::StatusOr<Points> NeuralModel::Deform(const NeuralCharacter& source, const NeuralCharacter& reference,
                                           const Points& points, const RowMatrix& weights,
                                           int threads) const {
  STANCE_CHECK(points.rows() == weights.rows());
  try {
    torch::InferenceMode inference;
    at::set_num_threads(threads);
    const torch::Device device = networks_->device;
    const auto joints = [&](const NeuralCharacter& character) {
      return Tensor(character.normalization.Apply(character.joints), device).unsqueeze(0);
    };
    const auto latents = networks_->transfer->Latents(Tensor(source.features, device).unsqueeze(0),
                                                      Tensor(reference.features, device).unsqueeze(0),
                                                      joints(source), joints(reference));
    const auto decoded =
        networks_->transfer->Decode(latents, Tensor(weights, device),
                                    Tensor(source.normalization.Apply(points), device), {0, points.rows()});
    return source.normalization.Invert(RowsOf(decoded.cpu(), 0, points.rows()));
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("network: {}", error.what()));
  }
}

}  // namespace stance
