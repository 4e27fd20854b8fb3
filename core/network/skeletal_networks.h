// Paper A's two networks with its exact widths: 3,377,691 parameters in all. Includes Torch.
#pragma once

#include <torch/torch.h>

#include "core/network/edge_conv.h"
#include "core/network/skeleton_edge_conv.h"
#include "core/network/tensors.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// Three GKEdgeConv layers 3 -> 64 -> 128 -> 256 with skip concatenation: a batch of N rows -> (N, 451).
class GkStackImpl : public torch::nn::Module {
 public:
  static constexpr int64_t kChannels = 3 + 64 + 128 + 256;

  explicit GkStackImpl(bool batch_norm);
  torch::Tensor forward(const PointBatch& batch);
  torch::Tensor ForwardPlain(const PointBatch& batch);

  torch::nn::ModuleList layers;
};
TORCH_MODULE(GkStack);

// f_C: skinning confidences A (paper A, section 3.1.1). A batch of N rows -> logits (N, 24).
// Global feature 451 -> 512, max and mean over the mesh (1024); head 1475 -> 1024 -> 256 -> 64 -> 24.
class WeightNetworkImpl : public torch::nn::Module {
 public:
  WeightNetworkImpl();
  torch::Tensor forward(const PointBatch& batch);
  // Logits of the given rows only (int64): all that a loss over a subset needs of the head.
  torch::Tensor ForwardRows(const PointBatch& batch, const torch::Tensor& rows);
  torch::Tensor ForwardPlain(const PointBatch& batch);

  GkStack stack{nullptr};
  LinearNorm pooled{nullptr}, head1{nullptr}, head2{nullptr}, head3{nullptr};
  torch::nn::Linear out{nullptr};

 private:
  torch::Tensor Head(const PointBatch& batch, const torch::Tensor& features, const torch::Tensor* rows);
};
TORCH_MODULE(WeightNetwork);

// f_J: joints from points and rigid weights (section 3.1.2). -> (B, 24, 3), normalised as the points are.
// Joint convolutions over the skeleton's own one-ring 451 -> 256 -> 128 -> 64, concatenated (448), then
// 448 -> 512 -> 256 -> 3.
class JointNetworkImpl : public torch::nn::Module {
 public:
  JointNetworkImpl();
  torch::Tensor forward(const PointBatch& batch, const torch::Tensor& weights);
  torch::Tensor ForwardPlain(const PointBatch& batch, const torch::Tensor& weights);

  GkStack stack{nullptr};
  SkeletonEdgeConv joint_layers{nullptr};
  LinearNorm mlp1{nullptr}, mlp2{nullptr};
  torch::nn::Linear out{nullptr};

 private:
  torch::Tensor Joints(const torch::Tensor& pooled);
};
TORCH_MODULE(JointNetwork);

// One-hot rows (N, 24) of the largest logit (equation 1).
torch::Tensor RigidWeights(const torch::Tensor& logits);

int64_t ParameterCount(const torch::nn::Module& module);

}  // namespace stance
