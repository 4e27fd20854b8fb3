#include "core/transfer/pose_estimation.h"

#include <optional>
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

// The first look: at meshes as they stand, and where it is not sure, at the side on which one view of the
// network is surest.
absl::StatusOr<std::vector<PoseEstimate>> FirstLook(const PoseModel& model,
                                                    std::span<const PyramidInput> inputs, int threads,
                                                    const PoseEstimationOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> estimates,
                          MeanOverViews(model, PosePass::kFirst, inputs, options.views, threads));
  std::vector<size_t> unsure;
  for (size_t i = 0; i < inputs.size(); ++i) {
    if (estimates[i].confidence.mean() < options.least_confidence) unsure.push_back(i);
  }
  const std::vector<PoseView> sides = OtherSides();
  std::vector<PyramidInput> glances;  // a mesh's sides side by side
  for (const size_t i : unsure) {
    for (const PoseView& side : sides) glances.push_back(ViewedInput(inputs[i], side));
  }
  STANCE_ASSIGN_OR_RETURN(const std::vector<PoseEstimate> glanced,
                          model.Infer(glances, threads, PosePass::kFirst));
  std::vector<PyramidInput> surest;
  std::vector<std::pair<size_t, PoseView>> origin;  // of each: the mesh and its side
  for (size_t u = 0; u < unsure.size(); ++u) {
    float most = estimates[unsure[u]].confidence.mean();
    std::optional<size_t> best;
    for (size_t s = 0; s < sides.size(); ++s) {
      const float confidence = glanced[u * sides.size() + s].confidence.mean();
      if (confidence > most) {
        most = confidence;
        best = s;
      }
    }
    if (!best) continue;
    surest.push_back(std::move(glances[u * sides.size() + *best]));
    origin.emplace_back(unsure[u], sides[*best]);
  }
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> looks,
                          MeanOverViews(model, PosePass::kFirst, surest, options.views, threads));
  for (size_t k = 0; k < looks.size(); ++k) {
    const auto& [i, side] = origin[k];
    if (looks[k].confidence.mean() <= estimates[i].confidence.mean()) continue;
    estimates[i] = EstimateBehindView(std::move(looks[k]), side);
  }
  return estimates;
}

void FitJointsOf(PoseEstimate& estimate, float stiffness) {
  estimate.joints = FitJoints(
      HumanSkeleton(), {estimate.joints, estimate.bones, estimate.rotations, estimate.confidence}, stiffness);
}

}  // namespace

absl::StatusOr<std::vector<PoseEstimate>> EstimatePoses(const PoseModel& model,
                                                        std::span<const PyramidInput> inputs, int threads,
                                                        const PoseEstimationOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> estimates, FirstLook(model, inputs, threads, options));
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
