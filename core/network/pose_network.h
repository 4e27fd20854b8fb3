// The network of METHOD_STANCE: from surface samples to skinning weights, rest-pose coordinates, joints and
// the joints' rotations from the rest pose. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <array>
#include <vector>

#include "core/network/linear_norm.h"
#include "core/network/tensors.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// An edge convolution with the norm behind the maximum:
// y_v = LeakyReLU(BN(W_a x_v + max over u in N(v) of W_b (x_u - x_v))).
// Where the output is coarser than the input, `self` holds the input features of the rows that remain.
// x (N, in), self (M, in), table (M, K) int32 rows of x -> (M, out). Parameters: 2 in out + 2 out.
class MaxConvImpl : public torch::nn::Module {
 public:
  MaxConvImpl(int64_t in, int64_t out);
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& self, const torch::Tensor& table);

  torch::Tensor weight_self;  // (out, in)
  torch::Tensor weight_edge;  // (out, in)
  torch::nn::BatchNorm1d norm{nullptr};
};
TORCH_MODULE(MaxConv);

// Lets the joints of a mesh know of each other: x + LeakyReLU(LN(W [x, mean over skeleton neighbours, M x]))
// with M (24, 24) learned; x (B, 24, C) -> (B, 24, C).
class JointMixImpl : public torch::nn::Module {
 public:
  explicit JointMixImpl(int64_t width);
  torch::Tensor forward(const torch::Tensor& x);

  torch::Tensor weight;      // (C, 3 C)
  torch::Tensor mix;         // M
  torch::Tensor neighbours;  // (24, 24) rows average a joint's parent and children; not learned
  torch::nn::LayerNorm norm{nullptr};
};
TORCH_MODULE(JointMix);

struct PosePrediction {
  torch::Tensor logits;      // (N, 24), softmax gives the skinning weights
  torch::Tensor canonical;   // (N, 3) the sample's place on the neutral body at rest (training/character.h)
  torch::Tensor joints;      // (B, 24, 3) normalised as the points are
  torch::Tensor bones;       // (B, 24, 3) from the parent to the joint in the rest pose, normalised likewise
  torch::Tensor rotations;   // (B, 24, 3, 3) global, from the rest pose
  torch::Tensor confidence;  // (B, 24) logit of the probability that joint and rotation are right
};

// Three levels (all samples, a quarter, a sixteenth: prefixes of the farthest-point order), edge convolutions
// down to the coarsest and up again by interpolation over the 3 nearest, with skips; one global feature.
//   down  6 -> 64 -> 96 | 160 -> 192 | 256 -> 256, max over the mesh -> 256
//   up    [256 up, 192, global 256] -> 256 -> 256 | [256 up, 64, 96] -> 256 -> 128 -> 24 + 3
//   joints  weight-pooled features [256, 256, global 256, centroid 3, second moments 6, the covariance of
//           place and predicted rest-pose place 9, the joint's own 32] -> 512, two layers that mix the
//           joints, and per joint 512 -> 3 (from the centroid), 6, 3 (the bone), 1
// Rotations are Gram-Schmidt of 6 numbers (Zhou et al., On the Continuity of Rotation Representations, 2019).
class PoseNetworkImpl : public torch::nn::Module {
 public:
  PoseNetworkImpl();

  // `pool_weights` (N, 24), if defined, replaces the predicted weights where features are pooled per joint.
  PosePrediction forward(const PyramidBatch& batch, const torch::Tensor& pool_weights = {});

  MaxConv down1{nullptr}, down2{nullptr}, down3{nullptr}, down4{nullptr}, down5{nullptr}, down6{nullptr};
  MaxConv up_conv{nullptr};
  LinearNorm global{nullptr}, up1{nullptr}, up0{nullptr}, head{nullptr};
  torch::nn::Linear out{nullptr};
  torch::Tensor joint_embedding;  // (24, 32)
  torch::Tensor joint_in;         // (512, all that is known of a joint)
  torch::nn::LayerNorm joint_norm{nullptr};
  JointMix mix1{nullptr}, mix2{nullptr};
  torch::Tensor joint_out;   // (24, 512, 3 + 6), a layer of its own for each joint
  torch::Tensor joint_bias;  // (24, 3 + 6)
  torch::Tensor bone_out;    // (24, 512, 3), and
  torch::Tensor bone_bias;   // (24, 3), likewise
  torch::nn::Linear confidence_out{nullptr};

 private:
  void Joints(const PyramidBatch& batch, const torch::Tensor& weights, const torch::Tensor& fine,
              const torch::Tensor& middle, const torch::Tensor& whole, PosePrediction& prediction);
};
TORCH_MODULE(PoseNetwork);

// (..., 6) -> (..., 3, 3), columns orthonormal and right-handed (Zhou et al. 2019, equation 15).
torch::Tensor RotationsFromSix(const torch::Tensor& six);

}  // namespace stance
