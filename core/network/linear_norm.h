// A shared linear layer with BatchNorm (or a bias) and LeakyReLU: the "MLP" of both papers' networks.
#pragma once

#include <torch/torch.h>

namespace stance {

// The slope of every LeakyReLU in paper A's networks.
inline constexpr double kLeakySlope = 0.2;

// LeakyReLU in place (the argument is a temporary everywhere).
inline torch::Tensor Leaky(torch::Tensor x) { return torch::leaky_relu_(x, kLeakySlope); }

// BatchNorm (eval mode) as y = scale * x + shift per channel.
struct NormFold {
  torch::Tensor scale;  // (C)
  torch::Tensor shift;  // (C)
};
NormFold FoldNorm(const torch::nn::BatchNorm1d& norm);

// y = LeakyReLU(BN(W x)) with batch_norm, else LeakyReLU(W x + b): x (N, in) -> (N, out).
// In eval mode the norm is folded into W, so that a layer is one product and one activation.
class LinearNormImpl : public torch::nn::Module {
 public:
  LinearNormImpl(int64_t in, int64_t out, bool batch_norm);

  torch::Tensor forward(const torch::Tensor& x);

  // The same with the input's last channels constant over each mesh, so that their part of the product is
  // taken once a mesh: x (N, in - G), per_mesh (B, G), mesh_of_row (N) int64.
  torch::Tensor ForwardSplit(const torch::Tensor& x, const torch::Tensor& per_mesh,
                             const torch::Tensor& mesh_of_row);

  torch::Tensor weight;  // (out, in)
  torch::Tensor bias;    // (out), undefined with batch_norm
  torch::nn::BatchNorm1d norm{nullptr};
};
TORCH_MODULE(LinearNorm);

}  // namespace stance
