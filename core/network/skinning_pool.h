// Between a mesh's points and its joints, along the skinning weights. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <vector>

namespace stance {

// O_j = sum_i W_ij F_i / sum_i W_ij per mesh (paper A, section 3.1.2; paper B, equation 10): features (N, C),
// weights (N, J) -> (B, J, C). A joint without vertices gets zeros.
torch::Tensor SkinningPool(const torch::Tensor& features, const torch::Tensor& weights,
                           const std::vector<int64_t>& offsets);

// T_i = sum_j W_ij T_j per mesh (paper B, equation 13): latents (B, J, C), weights (N, J) -> (N, C).
torch::Tensor SkinningUnpool(const torch::Tensor& latents, const torch::Tensor& weights,
                             const std::vector<int64_t>& offsets);

}  // namespace stance
