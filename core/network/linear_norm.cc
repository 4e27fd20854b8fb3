#include "core/network/linear_norm.h"

#include <cmath>

#include "core/network/norm_leaky.h"
#include "core/network/product.h"

namespace stance {

NormFold FoldNorm(const torch::nn::BatchNorm1d& norm) {
  const auto scale = norm->weight * (norm->running_var + norm->options.eps()).rsqrt();
  return {scale, norm->bias - scale * norm->running_mean};
}

LinearNormImpl::LinearNormImpl(int64_t in, int64_t out, bool batch_norm) {
  weight = register_parameter("weight", torch::empty({out, in}));
  torch::nn::init::kaiming_normal_(weight, kLeakySlope);
  if (batch_norm) {
    norm = register_module("norm", torch::nn::BatchNorm1d(out));
  } else {
    bias = register_parameter("bias", torch::zeros({out}));
  }
}

torch::Tensor LinearNormImpl::forward(const torch::Tensor& x) {
  if (!norm) return Leaky(is_training() ? Product(x, weight) + bias : torch::addmm(bias, x, weight.t()));
  if (is_training()) return NormLeaky(Product(x, weight), norm, kLeakySlope);
  const auto [scale, shift] = FoldNorm(norm);
  return Leaky(torch::addmm(shift, x, (weight * scale.unsqueeze(1)).t()));
}

torch::Tensor LinearNormImpl::ForwardSplit(const torch::Tensor& x, const torch::Tensor& per_mesh,
                                           const torch::Tensor& mesh_of_row) {
  const int64_t local = x.size(1);
  const auto w = weight.slice(1, 0, local), w_mesh = weight.slice(1, local);
  if (norm && is_training()) {
    const auto shared = torch::mm(per_mesh, w_mesh.t()).index_select(0, mesh_of_row);
    return NormLeaky(Product(x, w) + shared, norm, kLeakySlope);
  }
  const auto fold = norm ? FoldNorm(norm) : NormFold{torch::ones_like(bias), bias};
  const auto row_scale = fold.scale.unsqueeze(1);
  const auto shared = torch::addmm(fold.shift, per_mesh, (w_mesh * row_scale).t());
  if (per_mesh.size(0) == 1) {
    return Leaky(torch::addmm(shared, x, (w * row_scale).t()));
  }
  return Leaky(torch::mm(x, (w * row_scale).t()).add_(shared.index_select(0, mesh_of_row)));
}

}  // namespace stance
