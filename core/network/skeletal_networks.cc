#include "core/network/skeletal_networks.h"

#include "core/network/knn.h"
#include "core/network/skinning_pool.h"

namespace stance {
namespace {

constexpr int64_t kWidths[] = {3, 64, 128, 256};

}  // namespace

void AddSpatialNeighbors(PointBatch& batch) { batch.knn = KNearest(batch.points, batch.offsets); }

std::vector<int64_t> RowsPerMesh(const std::vector<int64_t>& offsets) {
  std::vector<int64_t> rows;
  for (size_t mesh = 0; mesh + 1 < offsets.size(); ++mesh) rows.push_back(offsets[mesh + 1] - offsets[mesh]);
  return rows;
}

torch::Tensor MeshOfRow(const std::vector<int64_t>& offsets, torch::Device device) {
  auto rows = torch::empty({offsets.back()}, torch::kInt64);
  for (size_t mesh = 0; mesh + 1 < offsets.size(); ++mesh) {
    rows.slice(0, offsets[mesh], offsets[mesh + 1]).fill_(static_cast<int64_t>(mesh));
  }
  return rows.to(device);
}

GkStackImpl::GkStackImpl(bool batch_norm) {
  for (int i = 0; i < 3; ++i) layers->push_back(GkEdgeConv(kWidths[i], kWidths[i + 1], batch_norm));
  register_module("layers", layers);
}

torch::Tensor GkStackImpl::forward(const PointBatch& batch) {
  std::vector<torch::Tensor> features = {batch.points};
  for (size_t i = 0; i < layers->size(); ++i) {
    // The first layer's features are the positions: its neighbours are shared by both networks.
    const auto knn = i == 0 && batch.knn.defined() ? batch.knn : KNearest(features.back(), batch.offsets);
    features.push_back(layers->at<GkEdgeConvImpl>(i).forward(features.back(), knn, batch.one_ring));
  }
  return torch::cat(features, 1);
}

torch::Tensor GkStackImpl::ForwardPlain(const PointBatch& batch) {
  std::vector<torch::Tensor> features = {batch.points};
  for (size_t i = 0; i < layers->size(); ++i) {
    const auto knn = KNearest(features.back(), batch.offsets);
    features.push_back(layers->at<GkEdgeConvImpl>(i).ForwardPlain(features.back(), knn, batch.one_ring));
  }
  return torch::cat(features, 1);
}

WeightNetworkImpl::WeightNetworkImpl() {
  stack = register_module("stack", GkStack(/*batch_norm=*/true));
  pooled = register_module("pooled", LinearNorm(GkStackImpl::kChannels, 512, true));
  head1 = register_module("head1", LinearNorm(GkStackImpl::kChannels + 1024, 1024, true));
  head2 = register_module("head2", LinearNorm(1024, 256, true));
  head3 = register_module("head3", LinearNorm(256, 64, true));
  out = register_module("out", torch::nn::Linear(64, kHumanJoints));
}

torch::Tensor WeightNetworkImpl::Head(const PointBatch& batch, const torch::Tensor& features,
                                      const torch::Tensor* rows) {
  const auto shared = pooled(features);
  std::vector<torch::Tensor> summaries;
  for (int64_t mesh = 0; mesh < batch.mesh_count(); ++mesh) {
    const auto part = shared.slice(0, batch.offsets[mesh], batch.offsets[mesh + 1]);
    summaries.push_back(torch::cat({std::get<0>(part.max(0)), part.mean(0)}));
  }
  auto mesh_of_row = MeshOfRow(batch.offsets, features.device());
  auto x = features;
  if (rows != nullptr) {
    x = x.index_select(0, *rows);
    mesh_of_row = mesh_of_row.index_select(0, *rows);
  }
  const auto summary = torch::stack(summaries);
  const auto layers = [&](const torch::Tensor& some, const torch::Tensor& mesh) {
    return out(head3(head2(head1->ForwardSplit(some, summary, mesh))));
  };
  constexpr int64_t kRows = 2048;  // a block's 1,024 channels stay in the cache
  if (is_training() || torch::GradMode::is_enabled() || x.size(0) <= kRows) return layers(x, mesh_of_row);
  auto logits = torch::empty({x.size(0), kHumanJoints}, x.options());
  for (int64_t begin = 0; begin < x.size(0); begin += kRows) {
    const int64_t end = std::min(begin + kRows, x.size(0));
    logits.slice(0, begin, end).copy_(layers(x.slice(0, begin, end), mesh_of_row.slice(0, begin, end)));
  }
  return logits;
}

torch::Tensor WeightNetworkImpl::forward(const PointBatch& batch) {
  return Head(batch, stack(batch), nullptr);
}

torch::Tensor WeightNetworkImpl::ForwardRows(const PointBatch& batch, const torch::Tensor& rows) {
  return Head(batch, stack(batch), &rows);
}

torch::Tensor WeightNetworkImpl::ForwardPlain(const PointBatch& batch) {
  return Head(batch, stack->ForwardPlain(batch), nullptr);
}

JointNetworkImpl::JointNetworkImpl() {
  stack = register_module("stack", GkStack(/*batch_norm=*/false));
  joint_layers = register_module(
      "joint_layers", SkeletonEdgeConv(GkStackImpl::kChannels, std::vector<int64_t>{256, 128, 64}));
  mlp1 = register_module("mlp1", LinearNorm(256 + 128 + 64, 512, false));
  mlp2 = register_module("mlp2", LinearNorm(512, 256, false));
  out = register_module("out", torch::nn::Linear(256, 3));
}

torch::Tensor JointNetworkImpl::Joints(const torch::Tensor& pooled) {
  return out(mlp2(mlp1(joint_layers(pooled).flatten(0, 1)))).reshape({pooled.size(0), kHumanJoints, 3});
}

torch::Tensor JointNetworkImpl::forward(const PointBatch& batch, const torch::Tensor& weights) {
  return Joints(SkinningPool(stack(batch), weights, batch.offsets));
}

torch::Tensor JointNetworkImpl::ForwardPlain(const PointBatch& batch, const torch::Tensor& weights) {
  return Joints(SkinningPool(stack->ForwardPlain(batch), weights, batch.offsets));
}

torch::Tensor RigidWeights(const torch::Tensor& logits) {
  return torch::zeros_like(logits).scatter_(1, logits.argmax(1, /*keepdim=*/true), 1);
}

int64_t ParameterCount(const torch::nn::Module& module) {
  int64_t count = 0;
  for (const auto& parameter : module.parameters()) count += parameter.numel();
  return count;
}

}  // namespace stance
