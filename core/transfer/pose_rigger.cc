#include "core/transfer/pose_rigger.h"

#include <utility>

#include "core/base/stopwatch.h"
#include "core/base/threads.h"
#include "core/mesh/resample.h"
#include "core/transfer/confidence.h"
#include "core/transfer/joint_fit.h"
#include "core/transfer/pose_views.h"

namespace stance {

absl::StatusOr<std::vector<Rig>> PoseRigger::RigMeshes(std::span<const TriangleMesh* const> meshes,
                                                       PhaseSeconds& seconds) const {
  Stopwatch watch;
  const auto count = std::ssize(meshes);
  const std::vector<PoseView> views = EvenViews(options_.views);
  std::vector<SurfaceSamples> samples(meshes.size());
  std::vector<PyramidInput> inputs(meshes.size() * views.size());  // a mesh's views side by side
  ParallelFor(count, threads_, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      samples[i] = ResampleSurface(*meshes[i], {model_.manifest().samples, model_.manifest().max_ring});
      const PyramidInput input = MakePyramidInput(samples[i], /*threads=*/1);
      for (size_t v = 0; v < views.size(); ++v) inputs[i * views.size() + v] = ViewedInput(input, views[v]);
    }
  });
  seconds.resample += watch.Lap();
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> seen, model_.Infer(inputs, threads_));
  std::vector<PoseEstimate> estimates;
  for (int64_t i = 0; i < count; ++i) {
    const std::span<PoseEstimate> own = std::span(seen).subspan(i * views.size(), views.size());
    for (size_t v = 0; v < views.size(); ++v) own[v] = EstimateBehindView(std::move(own[v]), views[v]);
    estimates.push_back(MeanEstimate(own));
  }
  std::vector<Rig> rigs(meshes.size());
  for (int64_t i = 0; i < count; ++i) {
    Rig& rig = rigs[i];
    rig.bones = std::move(estimates[i].bones);
    rig.rotations = std::move(estimates[i].rotations);
    // Calibrated behind the mean over the views, because that is what the calibration is fitted to.
    rig.confidence = estimates[i].confidence.unaryExpr([this](float p) {
      return static_cast<float>(CalibratedConfidence(p, model_.manifest().confidence));
    });
    rig.joints =
        FitJoints(skeleton(), {estimates[i].joints, rig.bones, rig.rotations, estimates[i].confidence},
                  options_.joint_stiffness);
    rig.weights.resize(meshes[i]->vertex_count(), kHumanJoints);
    for (int64_t v = 0; v < rig.weights.rows(); ++v) {
      rig.weights.row(v) = estimates[i].weights.row(samples[i].cell[v]);
    }
    rig.sampled = std::make_shared<const SampledWeights>(
        SampledWeights{std::move(samples[i]), std::move(estimates[i].weights)});
  }
  seconds.network += watch.Lap();
  return rigs;
}

}  // namespace stance
