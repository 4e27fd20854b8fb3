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
// Exact up to float32 rounding of the distances. Small sets go through one matrix product per mesh and a
// selection that skips whole blocks; large ones through a kd-tree, which wins from a few thousand rows on
// since features of a surface fill few dimensions. Carries no gradient. Runs on the tensor's device.
torch::Tensor KNearest(const torch::Tensor& features, const std::vector<int64_t>& offsets,
                       int k = kNeighbors);

// The two CPU ways, for tests and benchmarks; the arguments as above, one mesh.
torch::Tensor KNearestByProduct(const torch::Tensor& features, int k);
torch::Tensor KNearestByTree(const torch::Tensor& features, int k);

}  // namespace stance
