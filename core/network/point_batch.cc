#include <cstring>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/network/tensors.h"

namespace stance {

PointBatch StackInputs(std::span<const NetworkInput* const> inputs) {
  PointBatch batch;
  batch.offsets = {0};
  int64_t ring = 1;
  for (const NetworkInput* input : inputs) {
    batch.offsets.push_back(batch.offsets.back() + input->points.rows());
    ring = std::max<int64_t>(ring, input->one_ring.cols());
  }
  batch.points = torch::empty({batch.offsets.back(), 3});
  batch.one_ring = torch::empty({batch.offsets.back(), ring}, torch::kInt32);
  for (size_t mesh = 0; mesh < inputs.size(); ++mesh) {
    const NetworkInput& input = *inputs[mesh];
    const int64_t first = batch.offsets[mesh];
    STANCE_CHECK(input.one_ring.rows() == input.points.rows());
    const Points normalized = NormalizationOf(input.points).Apply(input.points);
    std::memcpy(batch.points.data_ptr<float>() + first * 3, normalized.data(),
                normalized.size() * sizeof(float));
    int32_t* rows = batch.one_ring.data_ptr<int32_t>() + first * ring;
    for (int64_t v = 0; v < input.one_ring.rows(); ++v) {
      for (int64_t i = 0; i < ring; ++i) {
        const int64_t neighbor = i < input.one_ring.cols() ? input.one_ring(v, i) : v;
        rows[v * ring + i] = static_cast<int32_t>(first + neighbor);
      }
    }
  }
  return batch;
}

PointBatch StackInputs(std::span<const NetworkInput> inputs, torch::Device device) {
  std::vector<const NetworkInput*> pointers;
  for (const NetworkInput& input : inputs) pointers.push_back(&input);
  PointBatch batch = StackInputs(pointers);
  batch.points = batch.points.to(device);
  batch.one_ring = batch.one_ring.to(device);
  AddSpatialNeighbors(batch);
  return batch;
}

RowMatrix RowsOf(const torch::Tensor& tensor, int64_t first, int64_t count) {
  const auto rows = tensor.slice(0, first, first + count).contiguous();
  return Eigen::Map<const RowMatrix>(rows.data_ptr<float>(), count, tensor.size(1));
}

}  // namespace stance
