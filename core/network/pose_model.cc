#include "core/network/pose_model.h"

#include <ATen/Parallel.h>
#include <fmt/format.h>

#include "core/base/check.h"
#include "core/network/model_files.h"
#include "core/network/pose_network.h"
#include "core/network/skeletal_networks.h"

namespace stance {
struct PoseModel::Networks {
  PoseNetwork pose, refinement{nullptr};
  torch::Device device = torch::cuda::is_available() ? torch::kCUDA : torch::kCPU;
};

PoseModel::PoseModel() : networks_(std::make_unique<Networks>()) {}
PoseModel::~PoseModel() = default;

absl::StatusOr<std::unique_ptr<PoseModel>> PoseModel::Load(const std::filesystem::path& dir) {
  try {
    STANCE_ASSIGN_OR_RETURN(ModelManifest manifest, ReadManifest(dir));
    if (manifest.method != kStanceMethod) {
      return absl::InvalidArgumentError(fmt::format("{}: the model is of the method '{}', not '{}'",
                                                    dir.string(), manifest.method, kStanceMethod));
    }
    STANCE_ASSIGN_OR_RETURN(const TensorMap tensors, ReadWeights(dir, manifest));
    std::unique_ptr<PoseModel> model(new PoseModel);
    Networks& networks = *model->networks_;
    if (HasModule(tensors, kRefinementNetworkPrefix)) networks.refinement = PoseNetwork();
    for (const auto& [prefix, network] : {std::pair{kPoseNetworkPrefix, &networks.pose},
                                          std::pair{kRefinementNetworkPrefix, &networks.refinement}}) {
      if (network->is_empty()) continue;
      if (const absl::Status status = LoadModule(**network, prefix, tensors); !status.ok()) {
        return absl::InvalidArgumentError(
            fmt::format("{}: {}", (dir / manifest.weights).string(), std::string(status.message())));
      }
      (*network)->eval();
      (*network)->to(networks.device);
    }
    model->manifest_ = std::move(manifest);
    return model;
  } catch (const std::exception& error) {  // Torch's wall
    return absl::InternalError(fmt::format("{}: {}", dir.string(), error.what()));
  }
}

absl::Status PoseModel::WriteUntrained(const std::filesystem::path& dir, uint64_t seed,
                                       ModelManifest manifest, bool refines) {
  torch::manual_seed(seed);
  const PoseNetwork pose;
  TensorMap tensors = ModuleTensors(*pose, kPoseNetworkPrefix, /*half=*/true);
  if (refines) {
    const PoseNetwork refinement;
    tensors.merge(ModuleTensors(*refinement, kRefinementNetworkPrefix, /*half=*/true));
  }
  manifest.method = kStanceMethod;
  return WriteModel(dir, std::move(manifest), tensors);
}

bool PoseModel::refines() const { return !networks_->refinement.is_empty(); }

int64_t PoseModel::parameter_count() const {
  return ParameterCount(*networks_->pose) + (refines() ? ParameterCount(*networks_->refinement) : 0);
}

absl::StatusOr<std::vector<PoseEstimate>> PoseModel::Infer(std::span<const PyramidInput> inputs, int threads,
                                                           PosePass pass) const {
  STANCE_CHECK(pass == PosePass::kFirst || refines());
  std::vector<PoseEstimate> estimates(inputs.size());
  if (inputs.empty()) return estimates;
  try {
    torch::InferenceMode inference;
    // OpenMP keeps a team per calling thread: the setting is this thread's own.
    at::set_num_threads(threads);
    std::vector<const PyramidInput*> pointers;
    for (const PyramidInput& input : inputs) pointers.push_back(&input);
    const PyramidBatch batch = StackPyramids(pointers);
    PoseNetwork& network = pass == PosePass::kFirst ? networks_->pose : networks_->refinement;
    const PosePrediction out = network->forward(batch.To(networks_->device));
    const auto weights = torch::softmax(out.logits, 1).cpu(), canonical = out.canonical.cpu();
    const auto joints = out.joints.reshape({-1, 3}).cpu(), rotations = out.rotations.reshape({-1, 9}).cpu();
    const auto bones = out.bones.reshape({-1, 3}).cpu();
    const auto confidence = torch::sigmoid(out.confidence).cpu();
    for (size_t mesh = 0; mesh < inputs.size(); ++mesh) {
      const int64_t first = batch.offsets[0][mesh], count = batch.offsets[0][mesh + 1] - first;
      const auto first_joint = static_cast<int64_t>(mesh) * kHumanJoints;
      PoseEstimate& estimate = estimates[mesh];
      estimate.weights = RowsOf(weights, first, count);
      estimate.canonical = RowsOf(canonical, first, count);
      const Normalization normalization = NormalizationOf(inputs[mesh].points);
      estimate.joints = normalization.Invert(RowsOf(joints, first_joint, kHumanJoints));
      estimate.bones = RowsOf(bones, first_joint, kHumanJoints) * normalization.scale;
      const RowMatrix nine = RowsOf(rotations, first_joint, kHumanJoints);
      for (int j = 0; j < kHumanJoints; ++j) {
        estimate.rotations.emplace_back(
            Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(nine.row(j).data()));
      }
      estimate.confidence = RowsOf(confidence, static_cast<int64_t>(mesh), 1).row(0).transpose();
    }
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("network: {}", error.what()));
  }
  return estimates;
}

}  // namespace stance
