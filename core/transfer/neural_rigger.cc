#include "core/transfer/neural_rigger.h"

#include <utility>

#include "core/base/stopwatch.h"
#include "core/base/threads.h"
#include "core/mesh/resample.h"
#include "core/transfer/sampled_rig.h"

namespace stance {

absl::StatusOr<std::vector<Rig>> NeuralRigger::RigMeshes(std::span<const TriangleMesh* const> meshes,
                                                         PhaseSeconds& seconds) const {
  Stopwatch watch;
  const auto count = std::ssize(meshes);
  std::vector<SurfaceSamples> samples(meshes.size());
  std::vector<NetworkInput> inputs(meshes.size());
  ParallelFor(count, threads_, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      samples[i] = ResampleSurface(*meshes[i], {model_.manifest().samples, model_.manifest().max_ring});
      inputs[i] = {samples[i].points, samples[i].one_ring};
    }
  });
  seconds.resample += watch.Lap();
  STANCE_ASSIGN_OR_RETURN(std::vector<NeuralRig> found, model_.Infer(inputs, threads_));
  std::vector<Rig> rigs(meshes.size());
  for (int64_t i = 0; i < count; ++i) {
    Rig& rig = rigs[i];
    rig.joints = std::move(found[i].joints);
    rig.features = std::move(found[i].features);
    BindBySamples(std::move(samples[i]), std::move(found[i].weights), rig);
  }
  seconds.network += watch.Lap();
  return rigs;
}

}  // namespace stance
