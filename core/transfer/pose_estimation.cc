#include "core/transfer/pose_estimation.h"

#include <optional>
#include <utility>

#include "core/skeleton/skeleton.h"
#include "core/transfer/joint_fit.h"
#include "core/transfer/pose_refinement.h"
#include "core/transfer/pose_views.h"

namespace stance {
namespace {

// The views in which a mesh's S samplings are seen, `count` of each: those of sampling s are every S-th from
// s on.
std::vector<PoseView> ViewsOf(PosePass pass, size_t samplings, int count) {
  const int all = static_cast<int>(samplings) * count;
  if (pass == PosePass::kFirst || all == 1) return EvenViews(all);
  const std::vector<PoseView> mirror = EvenViews(2);  // meshes bent back to rest face the same way
  std::vector<PoseView> views;
  for (int v = 0; v < all; ++v) views.push_back(mirror[v % 2]);
  return views;
}

// What is seen of a mesh in its samplings, each of which has its own estimate, as one.
PoseEstimate JoinedEstimate(std::span<const PoseEstimate> samplings) {
  int64_t rows = 0;
  for (const PoseEstimate& sampling : samplings) rows += sampling.weights.rows();
  RowMatrix weights(rows, kHumanJoints);
  Points canonical(rows, 3);
  std::vector<PoseEstimate> bodies;  // without samples
  rows = 0;
  for (const PoseEstimate& sampling : samplings) {
    weights.middleRows(rows, sampling.weights.rows()) = sampling.weights;
    canonical.middleRows(rows, sampling.weights.rows()) = sampling.canonical;
    rows += sampling.weights.rows();
    bodies.push_back({{}, {}, sampling.joints, sampling.bones, sampling.rotations, sampling.confidence});
  }
  PoseEstimate joined = MeanEstimate(bodies);
  joined.weights = std::move(weights);
  joined.canonical = std::move(canonical);
  return joined;
}

absl::StatusOr<std::vector<PoseEstimate>> MeanOverViews(const PoseModel& model, PosePass pass,
                                                        std::span<const Samplings> meshes, int count,
                                                        int threads) {
  std::vector<PyramidInput> viewed;  // a sampling's views side by side, and a mesh's samplings
  std::vector<PoseView> view_of;
  for (const Samplings& samplings : meshes) {
    const std::vector<PoseView> views = ViewsOf(pass, samplings.size(), count);
    for (size_t s = 0; s < samplings.size(); ++s) {
      for (size_t v = s; v < views.size(); v += samplings.size()) {
        viewed.push_back(ViewedInput(samplings[s], views[v]));
        view_of.push_back(views[v]);
      }
    }
  }
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> seen, model.Infer(viewed, threads, pass));
  for (size_t i = 0; i < seen.size(); ++i) seen[i] = EstimateBehindView(std::move(seen[i]), view_of[i]);
  std::vector<PoseEstimate> means;
  size_t next = 0;
  for (const Samplings& samplings : meshes) {
    std::vector<PoseEstimate> each;
    for (size_t s = 0; s < samplings.size(); ++s, next += count) {
      each.push_back(MeanEstimate(std::span(seen).subspan(next, count)));
    }
    means.push_back(JoinedEstimate(each));
  }
  return means;
}

Samplings Viewed(const Samplings& samplings, const PoseView& view) {
  Samplings viewed;
  for (const PyramidInput& sampling : samplings) viewed.push_back(ViewedInput(sampling, view));
  return viewed;
}

// The first look: at meshes as they stand, and where it is not sure, at the side on which one view of the
// network is surest.
absl::StatusOr<std::vector<PoseEstimate>> FirstLook(const PoseModel& model, std::span<const Samplings> meshes,
                                                    int threads, const PoseEstimationOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> estimates,
                          MeanOverViews(model, PosePass::kFirst, meshes, options.views, threads));
  std::vector<size_t> unsure;
  for (size_t i = 0; i < meshes.size(); ++i) {
    if (estimates[i].confidence.mean() < options.least_confidence) unsure.push_back(i);
  }
  const std::vector<PoseView> sides = OtherSides();
  std::vector<PyramidInput> glances;  // at one sampling; a mesh's sides side by side
  for (const size_t i : unsure) {
    for (const PoseView& side : sides) glances.push_back(ViewedInput(meshes[i][0], side));
  }
  STANCE_ASSIGN_OR_RETURN(const std::vector<PoseEstimate> glanced,
                          model.Infer(glances, threads, PosePass::kFirst));
  std::vector<Samplings> surest;
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
    surest.push_back(Viewed(meshes[unsure[u]], sides[*best]));
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

// Bends each sampling back by its own rows of the estimate's weights.
Samplings Unposed(const Samplings& samplings, const PoseEstimate& estimate) {
  Samplings unposed;
  PoseEstimate own = estimate;
  int64_t row = 0;
  for (const PyramidInput& sampling : samplings) {
    own.weights = estimate.weights.middleRows(row, sampling.points.rows());
    row += sampling.points.rows();
    unposed.push_back(UnposedInput(sampling, own));
  }
  return unposed;
}

}  // namespace

absl::StatusOr<std::vector<PoseEstimate>> EstimatePoses(const PoseModel& model,
                                                        std::span<const Samplings> meshes, int threads,
                                                        const PoseEstimationOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> estimates, FirstLook(model, meshes, threads, options));
  for (PoseEstimate& estimate : estimates) FitJointsOf(estimate, options.joint_stiffness);
  if (!model.refines() || options.refinement_views == 0) return estimates;

  std::vector<Samplings> unposed;
  for (size_t i = 0; i < meshes.size(); ++i) unposed.push_back(Unposed(meshes[i], estimates[i]));
  STANCE_ASSIGN_OR_RETURN(
      std::vector<PoseEstimate> refined,
      MeanOverViews(model, PosePass::kRefinement, unposed, options.refinement_views, threads));
  for (size_t i = 0; i < meshes.size(); ++i) {
    estimates[i] = EstimateBehindUnposing(std::move(refined[i]), estimates[i]);
    FitJointsOf(estimates[i], options.joint_stiffness);
  }
  return estimates;
}

}  // namespace stance
