#include <cstring>

#include "core/network/tensors.h"

namespace stance {
namespace {

torch::Tensor Tensor(const Points& points) {
  auto tensor = torch::empty({points.rows(), 3});
  std::memcpy(tensor.data_ptr<float>(), points.data(), points.size() * sizeof(float));
  return tensor;
}

// The table's rows behind `first` rows of other meshes.
torch::Tensor Shifted(const NeighborTable& table, int64_t first) {
  auto tensor = torch::empty({table.rows(), table.cols()}, torch::kInt32);
  Eigen::Map<NeighborTable>(tensor.data_ptr<int32_t>(), table.rows(), table.cols()) =
      table.array() + static_cast<int32_t>(first);
  return tensor;
}

}  // namespace

PyramidBatch StackPyramids(std::span<const PyramidInput* const> inputs) {
  PyramidBatch batch;
  for (auto& offsets : batch.offsets) offsets = {0};
  std::vector<torch::Tensor> points, normals, near[kPyramidLevels], coarse[kPyramidLevels - 1],
      rows[kPyramidLevels - 1];
  for (const PyramidInput* input : inputs) {
    points.push_back(Tensor(NormalizationOf(input->points).Apply(input->points)));
    normals.push_back(Tensor(input->normals));
    for (int level = 0; level < kPyramidLevels; ++level) {
      const int64_t first = batch.offsets[level].back(), count = RowsOfLevel(input->points.rows(), level);
      near[level].push_back(Shifted(input->near[level], first));
      if (level > 0) {
        const int64_t finer = batch.offsets[level - 1].end()[-2];
        coarse[level - 1].push_back(Shifted(input->coarse[level - 1], first));
        rows[level - 1].push_back(torch::arange(finer, finer + count, torch::kInt64));
      }
      batch.offsets[level].push_back(first + count);
    }
  }
  batch.points = torch::cat(points);
  batch.normals = torch::cat(normals);
  for (int level = 0; level < kPyramidLevels; ++level) batch.near[level] = torch::cat(near[level]);
  for (int level = 0; level + 1 < kPyramidLevels; ++level) {
    batch.coarse[level] = torch::cat(coarse[level]);
    batch.rows[level] = torch::cat(rows[level]);
  }
  return batch;
}

PyramidBatch PyramidBatch::To(torch::Device device) const {
  PyramidBatch moved = *this;
  for (torch::Tensor* tensor : {&moved.points, &moved.normals}) *tensor = tensor->to(device);
  for (auto& tensor : moved.near) tensor = tensor.to(device);
  for (auto& tensor : moved.coarse) tensor = tensor.to(device);
  for (auto& tensor : moved.rows) tensor = tensor.to(device);
  return moved;
}

}  // namespace stance
