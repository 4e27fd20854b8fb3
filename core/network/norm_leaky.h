// Batch normalisation in training and LeakyReLU as one operation. Includes Torch.
#pragma once

#include <torch/torch.h>

namespace stance {

// LeakyReLU(norm(x)) by the batch's own statistics, which also move the norm's running ones, as
// torch::nn::BatchNorm1d does in training: x (N, C) -> (N, C), N > 1. Differentiable. Two passes over the
// data forward and two backward, where the separate operations take seven.
torch::Tensor NormLeaky(const torch::Tensor& x, torch::nn::BatchNorm1d& norm, double slope);

}  // namespace stance
