#include "core/network/skeleton_edge_conv.h"

#include <algorithm>
#include <string>

#include "core/skeleton/skeleton.h"

namespace stance {
namespace {

// The joints' one-ring (parent and children), padded with the joint itself, for `meshes` stacked skeletons.
torch::Tensor JointRing(int64_t meshes, torch::Device device) {
  const Skeleton& skeleton = HumanSkeleton();
  std::vector<std::vector<int>> ring(kHumanJoints);
  size_t width = 0;
  for (int j = 0; j < kHumanJoints; ++j) {
    ring[j] = skeleton.children(j);
    if (j > 0) ring[j].push_back(skeleton.parents()[j]);
    width = std::max(width, ring[j].size());
  }
  auto table = torch::empty({kHumanJoints, static_cast<int64_t>(width)}, torch::kInt32);
  auto access = table.accessor<int32_t, 2>();
  for (int j = 0; j < kHumanJoints; ++j) {
    for (size_t i = 0; i < width; ++i) access[j][i] = i < ring[j].size() ? ring[j][i] : j;
  }
  const auto base = torch::arange(meshes, torch::kInt32).mul_(kHumanJoints).reshape({meshes, 1, 1});
  return (table.unsqueeze(0) + base).reshape({meshes * kHumanJoints, -1}).to(device);
}

}  // namespace

SkeletonEdgeConvImpl::SkeletonEdgeConvImpl(int64_t in, const std::vector<int64_t>& widths) {
  for (const int64_t width : widths) {
    layers.push_back(register_module(std::to_string(layers.size()), EdgeConv(in, width, false)));
    in = width;
  }
}

torch::Tensor SkeletonEdgeConvImpl::forward(const torch::Tensor& x) {
  const int64_t meshes = x.size(0);
  const auto ring = JointRing(meshes, x.device());
  std::vector<torch::Tensor> features;
  auto rows = x.reshape({meshes * kHumanJoints, -1});
  for (EdgeConv& layer : layers) {
    rows = layer(rows, ring);
    features.push_back(rows);
  }
  return torch::cat(features, 1).reshape({meshes, kHumanJoints, -1});
}

}  // namespace stance
