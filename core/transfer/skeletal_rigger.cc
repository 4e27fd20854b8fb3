#include "core/transfer/skeletal_rigger.h"

#include "core/base/stopwatch.h"
#include "core/base/threads.h"
#include "core/mesh/resample.h"

namespace stance {

absl::StatusOr<std::vector<Rig>> SkeletalRigger::RigMeshes(std::span<const TriangleMesh* const> meshes,
                                                           PhaseSeconds& seconds) const {
  Stopwatch watch;
  const auto count = static_cast<int64_t>(meshes.size());
  std::vector<NetworkInput> inputs(meshes.size());
  std::vector<std::vector<int32_t>> cells(meshes.size());
  ParallelFor(count, threads_, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      SurfaceSamples samples =
          full_resolution_
              ? VertexSamples(*meshes[i])
              : ResampleSurface(*meshes[i], {model_.manifest().samples, model_.manifest().max_ring});
      inputs[i] = {std::move(samples.points), std::move(samples.one_ring)};
      cells[i] = std::move(samples.cell);
    }
  });
  seconds.resample += watch.Lap();
  STANCE_ASSIGN_OR_RETURN(const std::vector<SkeletalPrediction> predictions, model_.Infer(inputs, threads_));
  std::vector<Rig> rigs(meshes.size());
  for (int64_t i = 0; i < count; ++i) {
    rigs[i].joints = predictions[i].joints;
    rigs[i].weights = RowMatrix::Zero(meshes[i]->vertex_count(), kHumanJoints);
    for (int64_t v = 0; v < meshes[i]->vertex_count(); ++v) {
      rigs[i].weights(v, predictions[i].joint_of[cells[i][v]]) = 1;
    }
  }
  seconds.network += watch.Lap();
  return rigs;
}

}  // namespace stance
