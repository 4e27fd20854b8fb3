#include "core/network/pose_network.h"

#include <cmath>

#include "core/network/gather.h"
#include "core/network/norm_leaky.h"
#include "core/network/product.h"
#include "core/network/skinning_pool.h"

namespace stance {
namespace {

constexpr int64_t kEmbedding = 32;
constexpr int64_t kMoments = 18;  // centroid, second moments and covariance
constexpr int64_t kJointWidth = 512;
// Brings normalised lengths (of the diagonal) and their squares to about one.
constexpr double kPointScale = 4, kMomentScale = 20, kOffsetScale = 0.1;

torch::Tensor SkeletonNeighbours() {
  const Skeleton& skeleton = HumanSkeleton();
  auto mean = torch::zeros({kHumanJoints, kHumanJoints});
  for (int j = 1; j < kHumanJoints; ++j) {
    mean[j][skeleton.parents()[j]] = 1;
    mean[skeleton.parents()[j]][j] = 1;
  }
  return mean / mean.sum(1, /*keepdim=*/true);
}

// Inverse squared distance over the three nearest coarse rows: features (M, C) -> (N, C).
torch::Tensor Interpolate(const torch::Tensor& features, const torch::Tensor& coarse_points,
                          const torch::Tensor& points, const torch::Tensor& table) {
  constexpr double kNear =
      1e-4;  // of the squared diagonal: a row that coincides with a coarse one takes over
  const auto to = coarse_points.index_select(0, table.reshape({-1})).reshape({points.size(0), -1, 3}) -
                  points.unsqueeze(1);
  const auto weight = (to.square().sum(2) + kNear).reciprocal();
  return GatherWeighted(features, table, weight / weight.sum(1, /*keepdim=*/true));
}

torch::Tensor LayerLeaky(const torch::Tensor& x, torch::nn::LayerNorm& norm) { return Leaky(norm(x)); }

// x_i x_j for the six pairs.
torch::Tensor Products(const torch::Tensor& x) { return torch::cat({x * x, x * x.roll({1}, {-1})}, -1); }

// The covariances (B, 24, 9) of the samples' places on the neutral body and on this one, which hold each
// limb's rotation, divided by their norms.
torch::Tensor Covariances(const torch::Tensor& canonical, const torch::Tensor& points,
                          const torch::Tensor& weights, const std::vector<int64_t>& offsets) {
  constexpr double kTiny = 1e-4;  // that of a limb of a hundredth of the body's size
  const auto products = [](const torch::Tensor& a, const torch::Tensor& b) {
    return (a.unsqueeze(-1) * b.unsqueeze(-2)).flatten(-2);
  };
  const auto covariance =
      SkinningPool(products(canonical, points), weights, offsets) -
      products(SkinningPool(canonical, weights, offsets), SkinningPool(points, weights, offsets));
  return covariance / (covariance.square().sum(-1, /*keepdim=*/true) + kTiny * kTiny).sqrt();
}

}  // namespace

JointMixImpl::JointMixImpl(int64_t width) {
  weight = register_parameter("weight", torch::empty({width, 3 * width}));
  torch::nn::init::kaiming_normal_(weight, kLeakySlope);
  mix = register_parameter("mix", 0.2 * torch::randn({kHumanJoints, kHumanJoints}));
  neighbours = register_buffer("neighbours", SkeletonNeighbours());
  norm = register_module("norm", torch::nn::LayerNorm(torch::nn::LayerNormOptions({width})));
}

torch::Tensor JointMixImpl::forward(const torch::Tensor& x) {
  const auto known = torch::cat({x, torch::matmul(neighbours, x), torch::matmul(mix, x)}, 2);
  return x + LayerLeaky(Product(known.flatten(0, 1), weight).view_as(x), norm);
}

torch::Tensor RotationsFromSix(const torch::Tensor& six) {
  const auto normalize = [](const torch::Tensor& v) {
    return torch::nn::functional::normalize(v, torch::nn::functional::NormalizeFuncOptions().dim(-1));
  };
  const auto a = normalize(six.slice(-1, 0, 3));
  const auto rest = six.slice(-1, 3, 6);
  const auto b = normalize(rest - (a * rest).sum(-1, /*keepdim=*/true) * a);
  return torch::stack({a, b, torch::linalg_cross(a, b)}, -1);
}

MaxConvImpl::MaxConvImpl(int64_t in, int64_t out) {
  for (auto& [name, weight] :
       {std::pair<const char*, torch::Tensor*>{"weight_self", &weight_self}, {"weight_edge", &weight_edge}}) {
    *weight = register_parameter(name, torch::empty({out, in}));
    torch::nn::init::kaiming_normal_(*weight, kLeakySlope);
  }
  norm = register_module("norm", torch::nn::BatchNorm1d(out));
}

torch::Tensor MaxConvImpl::forward(const torch::Tensor& x, const torch::Tensor& self,
                                   const torch::Tensor& table) {
  const auto edge = GatherMax(Product(x, weight_edge), table);
  const auto y = edge.add(Product(self, weight_self - weight_edge));
  if (is_training()) return NormLeaky(y, norm, kLeakySlope);
  const auto [scale, shift] = FoldNorm(norm);
  return Leaky(torch::addcmul(shift, y, scale));
}

PoseNetworkImpl::PoseNetworkImpl() {
  down1 = register_module("down1", MaxConv(6, 64));
  down2 = register_module("down2", MaxConv(64, 96));
  down3 = register_module("down3", MaxConv(96, 160));
  down4 = register_module("down4", MaxConv(160, 192));
  down5 = register_module("down5", MaxConv(192, 256));
  down6 = register_module("down6", MaxConv(256, 256));
  global = register_module("global_feature", LinearNorm(256, 256, true));
  up1 = register_module("up1", LinearNorm(256 + 192 + 256, 256, true));
  up_conv = register_module("up_conv", MaxConv(256, 256));
  up0 = register_module("up0", LinearNorm(256 + 64 + 96, 256, true));
  head = register_module("head", LinearNorm(256, 128, true));
  out = register_module("out", torch::nn::Linear(128, kHumanJoints + 3));
  joint_embedding = register_parameter("joint_embedding", 0.3 * torch::randn({kHumanJoints, kEmbedding}));
  joint_in = register_parameter("joint_in", torch::empty({kJointWidth, 3 * 256 + kMoments + kEmbedding}));
  torch::nn::init::kaiming_normal_(joint_in, kLeakySlope);
  joint_norm =
      register_module("joint_norm", torch::nn::LayerNorm(torch::nn::LayerNormOptions({kJointWidth})));
  mix1 = register_module("mix1", JointMix(kJointWidth));
  mix2 = register_module("mix2", JointMix(kJointWidth));
  joint_out = register_parameter("joint_out", torch::randn({kHumanJoints, kJointWidth, 9}) /
                                                  std::sqrt(static_cast<double>(kJointWidth)));
  joint_bias = register_parameter("joint_bias", torch::zeros({kHumanJoints, 9}));
  bone_out = register_parameter(
      "bone_out", torch::randn({kHumanJoints, kJointWidth, 3}) / std::sqrt(static_cast<double>(kJointWidth)));
  bone_bias = register_parameter("bone_bias", torch::zeros({kHumanJoints, 3}));
  confidence_out = register_module("confidence_out", torch::nn::Linear(kJointWidth, 1));
}

PosePrediction PoseNetworkImpl::forward(const PyramidBatch& batch, const torch::Tensor& pool_weights) {
  const auto x0 = torch::cat({batch.points * kPointScale, batch.normals}, 1);
  const auto x1 = down1(x0, x0, batch.near[0]);
  const auto x2 = down2(x1, x1, batch.near[0]);
  const auto& to_middle = batch.rows[0];  // fine rows of the middle level
  const auto x3 = down3(x2, x2.index_select(0, to_middle), batch.near[0].index_select(0, to_middle));
  const auto x4 = down4(x3, x3, batch.near[1]);
  const auto& to_coarse = batch.rows[1];  // middle rows of the coarse level
  const auto x5 = down5(x4, x4.index_select(0, to_coarse), batch.near[1].index_select(0, to_coarse));
  const auto x6 = down6(x5, x5, batch.near[2]);

  const auto pooled = global(x6);
  std::vector<torch::Tensor> wholes;
  const auto rows_per_mesh = RowsPerMesh(batch.offsets[2]);
  for (const auto& rows : pooled.split_with_sizes(rows_per_mesh)) wholes.push_back(std::get<0>(rows.max(0)));
  const auto whole = torch::stack(wholes);

  const auto middle_points = batch.points.index_select(0, to_middle);
  const auto coarse_points = middle_points.index_select(0, to_coarse);
  auto middle =
      up1->ForwardSplit(torch::cat({Interpolate(x6, coarse_points, middle_points, batch.coarse[1]), x4}, 1),
                        whole, MeshOfRow(batch.offsets[1], x0.device()));
  middle = up_conv(middle, middle, batch.near[1]);
  const auto fine =
      up0(torch::cat({Interpolate(middle, middle_points, batch.points, batch.coarse[0]), x1, x2}, 1));
  const auto samples = out(head(fine));

  PosePrediction prediction;
  prediction.logits = samples.slice(1, 0, kHumanJoints);
  prediction.canonical = samples.slice(1, kHumanJoints);
  const auto weights = pool_weights.defined() ? pool_weights : torch::softmax(prediction.logits, 1);
  Joints(batch, weights, fine, middle, whole, prediction);
  return prediction;
}

void PoseNetworkImpl::Joints(const PyramidBatch& batch, const torch::Tensor& weights,
                             const torch::Tensor& fine, const torch::Tensor& middle,
                             const torch::Tensor& whole, PosePrediction& prediction) {
  const int64_t meshes = batch.mesh_count();
  const auto centroid = SkinningPool(batch.points, weights, batch.offsets[0]);  // (B, 24, 3)
  const auto moments =
      (SkinningPool(Products(batch.points), weights, batch.offsets[0]) - Products(centroid)) * kMomentScale;
  const auto pooled_fine = SkinningPool(fine, weights, batch.offsets[0]);
  const auto pooled_middle = SkinningPool(middle, weights.index_select(0, batch.rows[0]), batch.offsets[1]);
  const auto covariance =
      Covariances(prediction.canonical.detach(), batch.points, weights.detach(), batch.offsets[0]);
  const auto known = torch::cat(
      {pooled_fine, pooled_middle, whole.unsqueeze(1).expand({meshes, kHumanJoints, whole.size(1)}),
       joint_embedding.unsqueeze(0).expand({meshes, kHumanJoints, kEmbedding}), centroid * kPointScale,
       moments, covariance},
      2);
  auto x = LayerLeaky(Product(known.flatten(0, 1), joint_in).view({meshes, kHumanJoints, kJointWidth}),
                      joint_norm);
  x = mix2(mix1(x));
  const auto values = torch::einsum("bjc,jco->bjo", {x, joint_out}) + joint_bias;
  prediction.bones = kOffsetScale * (torch::einsum("bjc,jco->bjo", {x, bone_out}) + bone_bias);
  prediction.joints = centroid + kOffsetScale * values.slice(2, 0, 3);
  static const auto kUpright = torch::tensor({1.f, 0.f, 0.f, 0.f, 1.f, 0.f});
  prediction.rotations = RotationsFromSix(values.slice(2, 3) + kUpright.to(values.device()));
  // Judges the features without changing them.
  prediction.confidence = confidence_out(x.detach()).squeeze(2);
}

}  // namespace stance
