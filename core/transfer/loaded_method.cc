#include "core/transfer/loaded_method.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "core/network/model_digests.h"
#include "core/network/model_manifest.h"
#include "core/network/neural_model.h"
#include "core/network/pose_model.h"
#include "core/network/skeletal_model.h"
#include "core/transfer/bone_rotation_solver.h"
#include "core/transfer/diffusion_smoother.h"
#include "core/transfer/learned_rotation_solver.h"
#include "core/transfer/model_folders.h"
#include "core/transfer/neural_deformer.h"
#include "core/transfer/neural_rigger.h"
#include "core/transfer/pose_rigger.h"
#include "core/transfer/screened_weights.h"
#include "core/transfer/skeletal_rigger.h"

namespace stance {
namespace {

template <typename Model>
ModelInfo InfoOf(Method method, const Model& model) {
  const ModelManifest& manifest = model.manifest();
  return {manifest.name,    manifest.version,   method, kHumanJoints, model.parameter_count(),
          manifest.samples, manifest.confidence};
}

class SkeletalMethod : public LoadedMethod {
 public:
  SkeletalMethod(std::unique_ptr<SkeletalModel> model, const PipelineOptions& options)
      : LoadedMethod(InfoOf(Method::kSkeletal, *model)),
        model_(std::move(model)),
        rigger_(*model_, options.threads, options.full_resolution) {}

  const Rigger& rigger() const override { return rigger_; }
  std::unique_ptr<PoseSolver> MakeSolver(const TransferOptions& options) const override {
    return std::make_unique<BoneRotationSolver>(options.twist);
  }
  std::unique_ptr<WeightSmoother> MakeWeightSmoother(const TransferOptions& options) const override {
    return MakeSmoother(options.smoothing);
  }

 private:
  const std::unique_ptr<SkeletalModel> model_;
  const SkeletalRigger rigger_;
};

class StanceMethod : public LoadedMethod {
 public:
  StanceMethod(std::unique_ptr<PoseModel> model, const PipelineOptions& options)
      : LoadedMethod(InfoOf(Method::kStance, *model)),
        model_(std::move(model)),
        rigger_(*model_, options.threads) {}

  const Rigger& rigger() const override { return rigger_; }
  std::unique_ptr<PoseSolver> MakeSolver(const TransferOptions&) const override {
    return std::make_unique<LearnedRotationSolver>();
  }
  std::unique_ptr<WeightSmoother> MakeWeightSmoother(const TransferOptions&) const override {
    return std::make_unique<ScreenedSmoother>();
  }

 private:
  const std::unique_ptr<PoseModel> model_;
  const PoseRigger rigger_;
};

class NeuralMethod : public LoadedMethod {
 public:
  NeuralMethod(std::unique_ptr<NeuralModel> model, const PipelineOptions& options)
      : LoadedMethod(InfoOf(Method::kNeural, *model)),
        model_(std::move(model)),
        rigger_(*model_, options.threads),
        deformer_(*model_) {}

  const Rigger& rigger() const override { return rigger_; }
  std::unique_ptr<PoseSolver> MakeSolver(const TransferOptions&) const override { return nullptr; }
  const PairDeformer* deformer() const override { return &deformer_; }
  std::unique_ptr<WeightSmoother> MakeWeightSmoother(const TransferOptions&) const override {
    return std::make_unique<ScreenedSmoother>();
  }

 private:
  const std::unique_ptr<NeuralModel> model_;
  const NeuralRigger rigger_;
  const NeuralDeformer deformer_;
};

uint64_t NextId() {
  static std::atomic<uint64_t> next = 0;
  return next++;
}

}  // namespace

LoadedMethod::LoadedMethod(ModelInfo info) : info_(std::move(info)), id_(NextId()) {}

absl::StatusOr<std::unique_ptr<LoadedMethod>> LoadedMethod::Load(const std::filesystem::path& model_dir,
                                                                 const PipelineOptions& options) {
  STANCE_ASSIGN_OR_RETURN(const ModelManifest manifest, ReadManifest(model_dir));
  STANCE_RETURN_IF_ERROR(CheckDigests(model_dir));
  if (options.full_resolution && manifest.method != kSkeletalMethod) {
    return absl::InvalidArgumentError(
        fmt::format("full_resolution: the method '{}' has none", manifest.method));
  }
  if (manifest.method == kNeuralMethod) {
    STANCE_ASSIGN_OR_RETURN(std::unique_ptr<NeuralModel> model, NeuralModel::Load(model_dir));
    return std::make_unique<NeuralMethod>(std::move(model), options);
  }
  if (manifest.method == kStanceMethod) {
    STANCE_ASSIGN_OR_RETURN(std::unique_ptr<PoseModel> model, PoseModel::Load(model_dir));
    return std::make_unique<StanceMethod>(std::move(model), options);
  }
  STANCE_ASSIGN_OR_RETURN(std::unique_ptr<SkeletalModel> model, SkeletalModel::Load(model_dir));
  return std::make_unique<SkeletalMethod>(std::move(model), options);
}

absl::StatusOr<std::vector<std::unique_ptr<LoadedMethod>>> LoadMethods(
    const std::vector<std::filesystem::path>& folders, const PipelineOptions& options) {
  STANCE_ASSIGN_OR_RETURN(const ModelFolders found, FindModelFolders(folders));
  std::vector<std::unique_ptr<LoadedMethod>> methods;
  for (const std::filesystem::path& model_dir : found.models) {
    STANCE_ASSIGN_OR_RETURN(std::unique_ptr<LoadedMethod> method, LoadedMethod::Load(model_dir, options));
    for (const auto& other : methods) {
      const ModelInfo &one = other->info(), &two = method->info();
      if (one.method == two.method) {
        return absl::InvalidArgumentError(fmt::format("{}: a second model of the method '{}', besides '{}'",
                                                      model_dir.string(), MethodName(two.method), one.name));
      }
      if (one.name == two.name) {
        return absl::InvalidArgumentError(
            fmt::format("{}: a second model of the name '{}'", model_dir.string(), two.name));
      }
    }
    methods.push_back(std::move(method));
  }
  if (methods.empty()) return absl::InvalidArgumentError("no model's folder is named");
  std::stable_partition(methods.begin(), methods.end(),
                        [](const auto& method) { return method->info().method == Method::kStance; });
  return methods;
}

}  // namespace stance
