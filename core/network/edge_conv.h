// Edge convolutions (paper A, equations 2-4) by their exact decomposition.
#pragma once

#include <torch/torch.h>

#include "core/network/linear_norm.h"

namespace stance {

// y_v = max over u in N(v) of LeakyReLU(BN(W [x_u - x_v, x_v])), or with a bias in place of BN.
// x (N, in), table (N, K) int32 -> (N, out). Parameters: 2 in out + 2 out with BN, + out with a bias.
//
// W [x_u - x_v, x_v] = W_a x_u + (W_b - W_a) x_v, so two products over vertices replace one over edges. BN is
// a scale per channel; folded into W first (it may be negative), what is left of the maximum is max_u W_a
// x_u. In training the batch statistics are those of all N K edges, as in the plain formulation.
class EdgeConvImpl : public torch::nn::Module {
 public:
  EdgeConvImpl(int64_t in, int64_t out, bool batch_norm);

  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& table);

  // The same without a gradient (eval mode), into `out` (N, out), which may be some columns of a wider
  // matrix.
  void ForwardInto(const torch::Tensor& x, const torch::Tensor& table, torch::Tensor out);

  // The formula as printed, over every edge: what tests and benchmarks compare with. Eval mode only.
  torch::Tensor ForwardPlain(const torch::Tensor& x, const torch::Tensor& table);

  torch::Tensor weight;  // (out, 2 in), acts on [x_u - x_v, x_v]
  torch::Tensor bias;    // (out), undefined with BN
  torch::nn::BatchNorm1d norm{nullptr};

 private:
  // Scale and shift from the statistics of this batch's edges, which also update the running ones.
  NormFold BatchFold(const torch::Tensor& a, const torch::Tensor& b, const torch::Tensor& table);
};
TORCH_MODULE(EdgeConv);

// GKEdgeConv: an edge convolution over the k nearest neighbours in feature space, one over the mesh's
// one-ring, concatenated and mixed by a linear layer (paper A, equation 4). x (N, in), knn (N, K), one_ring
// (N, R) -> (N, out). Parameters: 4 in out + 2 out^2 + 6 out with BN, + 3 out with biases.
class GkEdgeConvImpl : public torch::nn::Module {
 public:
  GkEdgeConvImpl(int64_t in, int64_t out, bool batch_norm);

  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& knn, const torch::Tensor& one_ring);
  torch::Tensor ForwardPlain(const torch::Tensor& x, const torch::Tensor& knn, const torch::Tensor& one_ring);

  EdgeConv nearest{nullptr};
  EdgeConv ring{nullptr};
  LinearNorm mix{nullptr};
};
TORCH_MODULE(GkEdgeConv);

}  // namespace stance
