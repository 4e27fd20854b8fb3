// Exact nearest neighbours in feature space. Includes Torch: for core/network and core/training only.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <vector>

namespace stance {

// Paper A's neighbourhood size, the vertex itself included.
inline constexpr int kNeighbors = 20;

// The k nearest rows of each row of `features` (N, C) within its own mesh (offsets, B + 1), the row itself
// included, nearest first: (N, k) int32 row indices. A mesh of fewer than k rows is padded with the row
// itself.
//
// Exact up to float32 rounding of the distances, by a RowIndex; on other devices by Torch. Carries no
// gradient. Runs on the tensor's device.
torch::Tensor KNearest(const torch::Tensor& features, const std::vector<int64_t>& offsets,
                       int k = kNeighbors);

// Torch's own way, all distances and a selection, for one mesh: what tests and benchmarks compare with.
// REQUIRES: k <= rows.
torch::Tensor KNearestByTorch(const torch::Tensor& features, int k);

}  // namespace stance
