// Edge convolutions between the joints of the human skeleton. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <vector>

#include "core/network/edge_conv.h"

namespace stance {

// Layers of x_j = max over i in N(j) of LeakyReLU(W [x_i - x_j, x_j] + b), N(j) the joint's parent and
// children (paper A, section 3.1.2; paper B, equation 11), their outputs concatenated:
// x (B, 24, in) -> (B, 24, sum of the widths).
class SkeletonEdgeConvImpl : public torch::nn::Module {
 public:
  SkeletonEdgeConvImpl(int64_t in, const std::vector<int64_t>& widths);
  torch::Tensor forward(const torch::Tensor& x);

  std::vector<EdgeConv> layers;  // registered as "0", "1", ...
};
TORCH_MODULE(SkeletonEdgeConv);

}  // namespace stance
