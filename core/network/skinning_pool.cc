#include "core/network/skinning_pool.h"

#include "core/network/tensors.h"

namespace stance {

torch::Tensor SkinningPool(const torch::Tensor& features, const torch::Tensor& weights,
                           const std::vector<int64_t>& offsets) {
  // Split, not sliced: the gradient of each slice would be as large as the whole.
  const std::vector<int64_t> sizes = RowsPerMesh(offsets);
  const auto weights_of = weights.split_with_sizes(sizes), features_of = features.split_with_sizes(sizes);
  std::vector<torch::Tensor> pooled;
  for (size_t mesh = 0; mesh < sizes.size(); ++mesh) {
    const auto& w = weights_of[mesh];
    pooled.push_back(torch::mm(w.t(), features_of[mesh]) / w.sum(0).clamp_min(1e-6).unsqueeze(1));
  }
  return torch::stack(pooled);
}

torch::Tensor SkinningUnpool(const torch::Tensor& latents, const torch::Tensor& weights,
                             const std::vector<int64_t>& offsets) {
  const std::vector<int64_t> sizes = RowsPerMesh(offsets);
  const auto weights_of = weights.split_with_sizes(sizes);
  const auto latents_of = latents.unbind(0);
  std::vector<torch::Tensor> blended;
  for (size_t mesh = 0; mesh < sizes.size(); ++mesh) {
    blended.push_back(torch::mm(weights_of[mesh], latents_of[mesh]));
  }
  return torch::cat(blended);
}

}  // namespace stance
