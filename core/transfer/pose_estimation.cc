#include "core/transfer/pose_estimation.h"

#include <utility>

#include "core/skeleton/skeleton.h"
#include "core/transfer/joint_fit.h"
#include "core/transfer/pose_refinement.h"
#include "core/transfer/pose_views.h"

namespace stance {
namespace {

absl::StatusOr<std::vector<PoseEstimate>> MeanOverViews(const PoseModel& model, PosePass pass,
                                                        std::span<const PyramidInput> inputs, int count,
                                                        int threads) {
  const std::vector<PoseView> views = EvenViews(count);
  std::vector<PyramidInput> viewed;  // a mesh's views side by side
  for (const PyramidInput& input : inputs) {
    for (const PoseView& view : views) viewed.push_back(ViewedInput(input, view));
  }
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> seen, model.Infer(viewed, threads, pass));
  std::vector<PoseEstimate> means;
  for (size_t i = 0; i < inputs.size(); ++i) {
    const std::span<PoseEstimate> own = std::span(seen).subspan(i * views.size(), views.size());
    for (size_t v = 0; v < views.size(); ++v) own[v] = EstimateBehindView(std::move(own[v]), views[v]);
    means.push_back(MeanEstimate(own));
  }
  return means;
}

void FitJointsOf(PoseEstimate& estimate, float stiffness) {
  estimate.joints = FitJoints(
      HumanSkeleton(), {estimate.joints, estimate.bones, estimate.rotations, estimate.confidence}, stiffness);
}

}  // namespace

absl::StatusOr<std::vector<PoseEstimate>> EstimatePoses(const PoseModel& model,
                                                        std::span<const PyramidInput> inputs, int threads,
                                                        const PoseEstimationOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> estimates,
                          MeanOverViews(model, PosePass::kFirst, inputs, options.views, threads));
  for (PoseEstimate& estimate : estimates) FitJointsOf(estimate, options.joint_stiffness);
  if (!model.refines() || options.refinement_views == 0) return estimates;

  std::vector<PyramidInput> unposed;
  for (size_t i = 0; i < inputs.size(); ++i) unposed.push_back(UnposedInput(inputs[i], estimates[i]));
  STANCE_ASSIGN_OR_RETURN(
      std::vector<PoseEstimate> refined,
      MeanOverViews(model, PosePass::kRefinement, unposed, options.refinement_views, threads));
  for (size_t i = 0; i < inputs.size(); ++i) {
    estimates[i] = EstimateBehindUnposing(std::move(refined[i]), estimates[i]);
    FitJointsOf(estimates[i], options.joint_stiffness);
  }
  return estimates;
}

}  // namespace stance
