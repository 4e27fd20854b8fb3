// The tensors' layout: how ragged batches of meshes lie in memory. Only core/network and core/training
// include this (it brings Torch in).
#pragma once

#include <torch/torch.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/network/network_input.h"
#include "core/network/pyramid_input.h"

namespace stance {

// B meshes of any sizes, their points stacked. Row r belongs to mesh b when offsets[b] <= r < offsets[b+1].
struct PointBatch {
  torch::Tensor points;          // (N, 3) float32, normalised: see Normalization in network_input.h
  torch::Tensor one_ring;        // (N, R) int32, rows of `points`; padded with the row itself
  torch::Tensor knn;             // (N, K) int32, nearest neighbours in space, the row itself included
  std::vector<int64_t> offsets;  // B + 1

  int64_t mesh_count() const { return static_cast<int64_t>(offsets.size()) - 1; }
};

// Normalises each input (NormalizationOf) and stacks them; `knn` is left for AddSpatialNeighbors.
PointBatch StackInputs(std::span<const NetworkInput* const> inputs);

// Fills `knn` of a batch that has its points.
void AddSpatialNeighbors(PointBatch& batch);

// The inputs as a network on `device` sees them: stacked, with `knn`.
PointBatch StackInputs(std::span<const NetworkInput> inputs, torch::Device device);

// B meshes as METHOD_STANCE's network sees them, each level stacked as above.
struct PyramidBatch {
  torch::Tensor points;   // (N, 3) float32, normalised
  torch::Tensor normals;  // (N, 3) float32
  // (rows of level l, 16) int32, rows of level l; and (rows of level l, 3) int32, rows of level l + 1.
  std::array<torch::Tensor, kPyramidLevels> near;
  std::array<torch::Tensor, kPyramidLevels - 1> coarse;
  // rows[l] int64: for each row of level l + 1, which row of level l it is.
  std::array<torch::Tensor, kPyramidLevels - 1> rows;
  std::array<std::vector<int64_t>, kPyramidLevels> offsets;  // B + 1 each

  int64_t mesh_count() const { return static_cast<int64_t>(offsets[0].size()) - 1; }
  PyramidBatch To(torch::Device device) const;
};

// Normalises each input (NormalizationOf) and stacks them.
PyramidBatch StackPyramids(std::span<const PyramidInput* const> inputs);

// Rows first .. first + count - 1 of a (., C) float32 tensor on the CPU.
RowMatrix RowsOf(const torch::Tensor& tensor, int64_t first, int64_t count);

// How many rows each mesh has: (B).
std::vector<int64_t> RowsPerMesh(const std::vector<int64_t>& offsets);

// The mesh that each row belongs to: (N) int64 on `device`.
torch::Tensor MeshOfRow(const std::vector<int64_t>& offsets, torch::Device device);

}  // namespace stance
