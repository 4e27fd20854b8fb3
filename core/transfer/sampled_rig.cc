#include "core/transfer/sampled_rig.h"

#include <utility>

namespace stance {

void BindBySamples(SurfaceSamples samples, RowMatrix weights, Rig& rig) {
  rig.weights.resize(std::ssize(samples.cell), weights.cols());
  for (int64_t v = 0; v < rig.weights.rows(); ++v) rig.weights.row(v) = weights.row(samples.cell[v]);
  rig.sampled =
      std::make_shared<const SampledWeights>(SampledWeights{std::move(samples), std::move(weights)});
}

}  // namespace stance
