// The pose transfer branch of METHOD_NEURAL (paper B, section 3.2). Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <vector>

#include "core/network/skeletal_networks.h"
#include "core/network/skeleton_edge_conv.h"

namespace stance {

// From two rigged meshes to the source in the reference's pose. The widths are ours (2,484,675 parameters):
// the paper gives none. Biases in place of norms, as in paper A's f_J.
//   f_GKE   3 -> 64 -> 128 -> 256 with skips (451), shared by source and reference, pooled per joint
//   joints  [O_s 451, O_r 451, C_s 3, C_r 3] -> SkeletonEdgeConv 512, 256, 128 (896) -> 512 -> T 256
//   f_d     [T_i 256, v_i 3] -> 512 -> 256 -> 128 -> 3
class TransferBranchImpl : public torch::nn::Module {
 public:
  static constexpr int64_t kLatent = 256;

  TransferBranchImpl();

  // O of each mesh, source or reference (equations 8 to 10): weights (N, 24) -> (B, 24, 451).
  torch::Tensor Pool(const PointBatch& batch, const torch::Tensor& weights);

  // T_j of B pairs (equations 11 and 12): O's (B, 24, 451) and C's (B, 24, 3), each normalised as its own
  // mesh's points are -> (B, 24, 256).
  torch::Tensor Latents(const torch::Tensor& source, const torch::Tensor& reference,
                        const torch::Tensor& source_joints, const torch::Tensor& reference_joints);

  // V_t = f_d([T_i, v_i]), T_i = sum_j W_ij T_j (equations 13 and 14), for any points of the sources:
  // weights (N, 24), points (N, 3), normalised -> (N, 3) in the same frame.
  //
  // f_d's first layer acts on T_i linearly: W_T sum_j W_ij T_j = sum_j W_ij (W_T T_j), a product over 24
  // joints in place of one over points.
  torch::Tensor Decode(const torch::Tensor& latents, const torch::Tensor& weights,
                       const torch::Tensor& points, const std::vector<int64_t>& offsets);

  // The formula as printed: what tests compare with.
  torch::Tensor DecodePlain(const torch::Tensor& latents, const torch::Tensor& weights,
                            const torch::Tensor& points, const std::vector<int64_t>& offsets);

  GkStack stack{nullptr};
  SkeletonEdgeConv joint_layers{nullptr};
  LinearNorm mlp{nullptr};
  torch::nn::Linear latent{nullptr};
  LinearNorm decode1{nullptr}, decode2{nullptr}, decode3{nullptr};
  torch::nn::Linear out{nullptr};
};
TORCH_MODULE(TransferBranch);

}  // namespace stance
