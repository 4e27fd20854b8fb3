// Maxima and sums over neighbourhoods: what the decomposed edge convolution and the interpolation between
// levels need beside matrix products. Includes Torch.
#pragma once

#include <torch/torch.h>

namespace stance {

// out[v, c] = max over u in table[v] of features[u, c]; features (N, C), table (M, K) int32 -> (M, C).
// Differentiable: the gradient goes to the (first) maximal neighbour.
torch::Tensor GatherMax(const torch::Tensor& features, const torch::Tensor& table);

// out[v, c] = LeakyReLU(out[v, c] + max over u in table[v] of features[u, c]), in place; `out` (M, C) may be
// some columns of a wider matrix. Carries no gradient.
void AddGatherMaxLeaky(const torch::Tensor& features, const torch::Tensor& table, double slope,
                       torch::Tensor out);

// out[v, c] = sum over u in table[v] of features[u, c]. Differentiable.
torch::Tensor GatherSum(const torch::Tensor& features, const torch::Tensor& table);

// out[v, c] = sum over j of weights[v, j] features[table[v, j], c]; weights as table (M, K). Differentiable
// with respect to the features.
torch::Tensor GatherWeighted(const torch::Tensor& features, const torch::Tensor& table,
                             const torch::Tensor& weights);

}  // namespace stance
