// The losses of METHOD_NEURAL (paper B, section 4). Includes Torch.
#pragma once

#include <torch/torch.h>

namespace stance {

// L_s = 1/(n m) sum_i sum_j T_ij log(T_ij / (W_ij + 1e-10)) over the joints that sparse weights W (N, 24)
// are positive on, T (N, 24) the true ones (equation 17, whose printed form lacks the minus sign). Zero where
// W = T. Where the truth lies on joints that W leaves out it may fall below zero: the terms it would be
// positive by are those that the equation leaves out.
torch::Tensor SparseWeightLoss(const torch::Tensor& weights, const torch::Tensor& truth);

// L_e: the mean square difference of edge lengths between `points` and `truth` (N, 3) over `edges` (E, 2)
// int64 rows (equation 20).
torch::Tensor EdgeLengthLoss(const torch::Tensor& points, const torch::Tensor& truth,
                             const torch::Tensor& edges);

}  // namespace stance
