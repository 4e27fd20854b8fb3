#include "core/transfer/pose_rigger.h"

#include <utility>

#include "core/base/stopwatch.h"
#include "core/base/threads.h"
#include "core/mesh/resample.h"
#include "core/transfer/confidence.h"
#include "core/transfer/sampled_rig.h"

namespace stance {

absl::StatusOr<std::vector<Rig>> PoseRigger::RigMeshes(std::span<const TriangleMesh* const> meshes,
                                                       PhaseSeconds& seconds) const {
  Stopwatch watch;
  const auto count = std::ssize(meshes);
  std::vector<std::vector<SurfaceSamples>> samples(meshes.size());
  std::vector<Samplings> inputs(meshes.size());
  ParallelFor(count, threads_, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      samples[i] = ResampleSurfaceRepeatedly(*meshes[i], options_.samplings,
                                             {model_.manifest().samples, model_.manifest().max_ring});
      for (const SurfaceSamples& sampling : samples[i]) {
        inputs[i].push_back(MakePyramidInput(sampling, /*threads=*/1, model_.manifest().features));
      }
    }
  });
  seconds.resample += watch.Lap();
  STANCE_ASSIGN_OR_RETURN(std::vector<PoseEstimate> estimates,
                          EstimatePoses(model_, inputs, threads_, options_));
  std::vector<Rig> rigs(meshes.size());
  for (int64_t i = 0; i < count; ++i) {
    Rig& rig = rigs[i];
    rig.joints = std::move(estimates[i].joints);
    rig.bones = std::move(estimates[i].bones);
    rig.rotations = std::move(estimates[i].rotations);
    // Calibrated last, because that is what the calibration is fitted to.
    rig.confidence = estimates[i].confidence.unaryExpr([this](float p) {
      return static_cast<float>(CalibratedConfidence(p, model_.manifest().confidence));
    });
    BindBySamples(JoinedSamples(std::move(samples[i])), std::move(estimates[i].weights), rig);
  }
  seconds.network += watch.Lap();
  return rigs;
}

}  // namespace stance
