#include "core/network/edge_conv.h"

#include "core/base/check.h"
#include "core/network/gather.h"
#include "core/network/product.h"

namespace stance {

EdgeConvImpl::EdgeConvImpl(int64_t in, int64_t out, bool batch_norm) {
  weight = register_parameter("weight", torch::empty({out, 2 * in}));
  torch::nn::init::kaiming_normal_(weight, kLeakySlope);
  if (batch_norm) {
    norm = register_module("norm", torch::nn::BatchNorm1d(out));
  } else {
    bias = register_parameter("bias", torch::zeros({out}));
  }
}

torch::Tensor EdgeConvImpl::forward(const torch::Tensor& x, const torch::Tensor& table) {
  const int64_t in = weight.size(1) / 2;
  const auto w_a = weight.slice(1, 0, in);
  const auto w_b = weight.slice(1, in) - w_a;
  if (!norm) return Leaky(GatherMax(Product(x, w_a), table) + (Product(x, w_b) + bias));
  if (is_training()) {
    const auto a = Product(x, w_a), b = Product(x, w_b);
    const auto [scale, shift] = BatchFold(a, b, table);
    return Leaky(GatherMax(a * scale, table) + torch::addcmul(shift, b, scale));
  }
  const auto [scale, shift] = FoldNorm(norm);
  const auto row_scale = scale.unsqueeze(1);
  return Leaky(GatherMax(torch::mm(x, (w_a * row_scale).t()), table) +
               torch::addmm(shift, x, (w_b * row_scale).t()));
}

void EdgeConvImpl::ForwardInto(const torch::Tensor& x, const torch::Tensor& table, torch::Tensor out) {
  STANCE_CHECK(!torch::GradMode::is_enabled() && !(norm && is_training()));
  const int64_t in = weight.size(1) / 2;
  auto w_a = weight.slice(1, 0, in), w_b = weight.slice(1, in) - w_a;
  auto shift = bias;
  if (norm) {
    const auto fold = FoldNorm(norm);
    const auto row_scale = fold.scale.unsqueeze(1);
    w_a = w_a * row_scale;
    w_b = w_b * row_scale;
    shift = fold.shift;
  }
  torch::addmm_out(out, shift, x, w_b.t());
  AddGatherMaxLeaky(torch::mm(x, w_a.t()), table, kLeakySlope, out);
}

NormFold EdgeConvImpl::BatchFold(const torch::Tensor& a, const torch::Tensor& b, const torch::Tensor& table) {
  // Over edges (v, u): E[a_u + b_v] and E[(a_u + b_v)^2] = E[a_u^2] + 2 E[b_v a_u] + E[b_v^2].
  const auto edges = static_cast<double>(table.numel());
  const auto k = static_cast<double>(table.size(1));
  const auto in_degree = torch::bincount(table.reshape({-1}).to(torch::kInt64), {}, a.size(0)).to(a.dtype());
  const auto degree = in_degree.unsqueeze(0);  // (1, N): sums over edges become products with it
  const auto mean = (torch::mm(degree, a).squeeze(0) + k * b.sum(0)) / edges;
  const auto square = (torch::mm(degree, a.square()).squeeze(0) + 2 * (b * GatherSum(a, table)).sum(0) +
                       k * b.square().sum(0)) /
                      edges;
  const auto variance = (square - mean.square()).clamp_min(0);
  {
    torch::NoGradGuard no_grad;
    const double momentum = norm->options.momentum().value_or(0.1);
    norm->running_mean.lerp_(mean.detach(), momentum);
    norm->running_var.lerp_(variance.detach() * (edges / std::max(1.0, edges - 1)), momentum);
    norm->num_batches_tracked.add_(1);
  }
  const auto scale = norm->weight * (variance + norm->options.eps()).rsqrt();
  return {scale, norm->bias - scale * mean};
}

torch::Tensor EdgeConvImpl::ForwardPlain(const torch::Tensor& x, const torch::Tensor& table) {
  STANCE_CHECK(!is_training());
  const int64_t n = table.size(0), k = table.size(1);
  const auto neighbor = x.index_select(0, table.reshape({-1}).to(torch::kInt64));
  const auto self = x.unsqueeze(1).expand({n, k, x.size(1)}).reshape({n * k, -1});
  auto edge = torch::mm(torch::cat({neighbor - self, self}, 1), weight.t());
  edge = norm ? norm(edge) : edge + bias;
  return std::get<0>(torch::leaky_relu(edge, kLeakySlope).reshape({n, k, -1}).max(1));
}

GkEdgeConvImpl::GkEdgeConvImpl(int64_t in, int64_t out, bool batch_norm) {
  nearest = register_module("nearest", EdgeConv(in, out, batch_norm));
  ring = register_module("ring", EdgeConv(in, out, batch_norm));
  mix = register_module("mix", LinearNorm(2 * out, out, batch_norm));
}

torch::Tensor GkEdgeConvImpl::forward(const torch::Tensor& x, const torch::Tensor& knn,
                                      const torch::Tensor& one_ring) {
  if (torch::GradMode::is_enabled() || is_training()) {
    return mix(torch::cat({nearest(x, knn), ring(x, one_ring)}, 1));
  }
  const int64_t width = nearest->weight.size(0);
  auto both = torch::empty({x.size(0), 2 * width}, x.options());
  nearest->ForwardInto(x, knn, both.narrow(1, 0, width));
  ring->ForwardInto(x, one_ring, both.narrow(1, width, width));
  return mix(both);
}

torch::Tensor GkEdgeConvImpl::ForwardPlain(const torch::Tensor& x, const torch::Tensor& knn,
                                           const torch::Tensor& one_ring) {
  return mix(torch::cat({nearest->ForwardPlain(x, knn), ring->ForwardPlain(x, one_ring)}, 1));
}

}  // namespace stance
