#include "core/transfer/loaded_method.h"

#include <fmt/format.h>

#include <utility>

#include "core/network/model_manifest.h"
#include "core/network/pose_model.h"
#include "core/network/skeletal_model.h"
#include "core/transfer/bone_rotation_solver.h"
#include "core/transfer/diffusion_smoother.h"
#include "core/transfer/learned_rotation_solver.h"
#include "core/transfer/pose_rigger.h"
#include "core/transfer/screened_weights.h"
#include "core/transfer/skeletal_rigger.h"

namespace stance {
namespace {

template <typename Model>
ModelInfo InfoOf(Method method, const Model& model) {
  const ModelManifest& manifest = model.manifest();
  return {manifest.name, manifest.version, method, kHumanJoints, model.parameter_count(), manifest.samples};
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

}  // namespace

absl::StatusOr<std::unique_ptr<LoadedMethod>> LoadedMethod::Load(const std::filesystem::path& model_dir,
                                                                 const PipelineOptions& options) {
  STANCE_ASSIGN_OR_RETURN(const ModelManifest manifest, ReadManifest(model_dir));
  if (manifest.method == kStanceMethod) {
    if (options.full_resolution) {
      return absl::InvalidArgumentError(
          fmt::format("full_resolution: the method '{}' has none", kStanceMethod));
    }
    STANCE_ASSIGN_OR_RETURN(std::unique_ptr<PoseModel> model, PoseModel::Load(model_dir));
    return std::make_unique<StanceMethod>(std::move(model), options);
  }
  STANCE_ASSIGN_OR_RETURN(std::unique_ptr<SkeletalModel> model, SkeletalModel::Load(model_dir));
  return std::make_unique<SkeletalMethod>(std::move(model), options);
}

}  // namespace stance
