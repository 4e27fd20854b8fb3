#include "core/network/norm_leaky.h"

#include <ATen/Parallel.h>

#include <cstdint>
#include <vector>

#include "core/base/check.h"
#include "core/base/lanes.h"
#include "core/base/multiversion.h"

namespace stance {
namespace {

using torch::autograd::AutogradContext;
using torch::autograd::tensor_list;

// Rows summed in float32 before they are added to the totals.
constexpr int64_t kBlock = 64;
constexpr int64_t kChannelGrain = 64;

// The loops take eight channels at a time by hand: GCC makes no vector code of LeakyReLU's branch by itself.

// All kernels take channels [first, last) of N rows of C.

// Sums of x and of x^2.
STANCE_MULTIVERSION void Moments(const float* x, int64_t n, int64_t c, int64_t first, int64_t last,
                                 double* sum, double* square) {
  std::vector<float> block_sum(last - first), block_square(last - first);
  float* s = block_sum.data();
  float* q = block_square.data();
  for (int64_t begin = 0; begin < n; begin += kBlock) {
    std::fill(block_sum.begin(), block_sum.end(), 0.0f);
    std::fill(block_square.begin(), block_square.end(), 0.0f);
    for (int64_t v = begin; v < std::min(n, begin + kBlock); ++v) {
      const float* row = x + v * c + first;
      for (int64_t i = 0; i < last - first; ++i) {
        s[i] += row[i];
        q[i] += row[i] * row[i];
      }
    }
    for (int64_t i = 0; i < last - first; ++i) {
      sum[first + i] += s[i];
      square[first + i] += q[i];
    }
  }
}

STANCE_MULTIVERSION void Forward(const float* x, const float* scale, const float* shift, float slope,
                                 int64_t n, int64_t c, int64_t first, int64_t last, float* out) {
  for (int64_t v = 0; v < n; ++v) {
    const float* row = x + v * c;
    float* o = out + v * c;
    int64_t i = first;
    for (; i + 8 <= last; i += 8) {
      const Lanes y = LanesAt(row + i) * LanesAt(scale + i) + LanesAt(shift + i);
      LanesAt(o + i) = y > 0 ? y : slope * y;
    }
    for (; i < last; ++i) {
      const float y = row[i] * scale[i] + shift[i];
      o[i] = y > 0 ? y : slope * y;
    }
  }
}

// Sums of g and of g x, where g is the gradient before the activation.
STANCE_MULTIVERSION void GradientMoments(const float* x, const float* gradient, const float* scale,
                                         const float* shift, float slope, int64_t n, int64_t c, int64_t first,
                                         int64_t last, double* sum, double* product) {
  std::vector<float> block_sum(last - first), block_product(last - first);
  float* s = block_sum.data();
  float* q = block_product.data();
  for (int64_t begin = 0; begin < n; begin += kBlock) {
    std::fill(block_sum.begin(), block_sum.end(), 0.0f);
    std::fill(block_product.begin(), block_product.end(), 0.0f);
    for (int64_t v = begin; v < std::min(n, begin + kBlock); ++v) {
      const float *row = x + v * c + first, *upstream = gradient + v * c + first;
      int64_t i = 0;
      for (; i + 8 <= last - first; i += 8) {
        const Lanes value = LanesAt(row + i);
        const Lanes y = value * LanesAt(scale + first + i) + LanesAt(shift + first + i);
        const Lanes up = LanesAt(upstream + i), g = y > 0 ? up : slope * up;
        LanesAt(s + i) += g;
        LanesAt(q + i) += g * value;
      }
      for (; i < last - first; ++i) {
        const float y = row[i] * scale[first + i] + shift[first + i];
        const float g = y > 0 ? upstream[i] : slope * upstream[i];
        s[i] += g;
        q[i] += g * row[i];
      }
    }
    for (int64_t i = 0; i < last - first; ++i) {
      sum[first + i] += s[i];
      product[first + i] += q[i];
    }
  }
}

// scale g - a - b x.
STANCE_MULTIVERSION void Backward(const float* x, const float* gradient, const float* scale,
                                  const float* shift, const float* a, const float* b, float slope, int64_t n,
                                  int64_t c, int64_t first, int64_t last, float* out) {
  for (int64_t v = 0; v < n; ++v) {
    const float *row = x + v * c, *upstream = gradient + v * c;
    float* o = out + v * c;
    int64_t i = first;
    for (; i + 8 <= last; i += 8) {
      const Lanes value = LanesAt(row + i), gain = LanesAt(scale + i);
      const Lanes y = value * gain + LanesAt(shift + i);
      const Lanes up = LanesAt(upstream + i), g = y > 0 ? up : slope * up;
      LanesAt(o + i) = gain * g - LanesAt(a + i) - LanesAt(b + i) * value;
    }
    for (; i < last; ++i) {
      const float y = row[i] * scale[i] + shift[i];
      const float g = y > 0 ? upstream[i] : slope * upstream[i];
      o[i] = scale[i] * g - a[i] - b[i] * row[i];
    }
  }
}

struct NormLeakyFunction : torch::autograd::Function<NormLeakyFunction> {
  static torch::Tensor forward(AutogradContext* ctx, const torch::Tensor& input, const torch::Tensor& weight,
                               const torch::Tensor& bias, const torch::Tensor& mean,
                               const torch::Tensor& rstd, double slope) {
    const auto x = input.contiguous();
    const int64_t n = x.size(0), c = x.size(1);
    const auto scale = weight * rstd, shift = bias - scale * mean;
    auto out = torch::empty_like(x);
    at::parallel_for(0, c, kChannelGrain, [&](int64_t first, int64_t last) {
      Forward(x.data_ptr<float>(), scale.data_ptr<float>(), shift.data_ptr<float>(),
              static_cast<float>(slope), n, c, first, last, out.data_ptr<float>());
    });
    ctx->save_for_backward({x, scale, shift, mean, rstd});
    ctx->saved_data["slope"] = slope;
    return out;
  }

  static tensor_list backward(AutogradContext* ctx, const tensor_list& grads) {
    const auto saved = ctx->get_saved_variables();
    const auto &x = saved[0], &scale = saved[1], &shift = saved[2], &mean = saved[3], &rstd = saved[4];
    const auto slope = static_cast<float>(ctx->saved_data["slope"].toDouble());
    const auto upstream = grads[0].contiguous();
    const int64_t n = x.size(0), c = x.size(1);
    auto sum = torch::zeros({c}, torch::kFloat64), product = torch::zeros({c}, torch::kFloat64);
    at::parallel_for(0, c, kChannelGrain, [&](int64_t first, int64_t last) {
      GradientMoments(x.data_ptr<float>(), upstream.data_ptr<float>(), scale.data_ptr<float>(),
                      shift.data_ptr<float>(), slope, n, c, first, last, sum.data_ptr<double>(),
                      product.data_ptr<double>());
    });
    // Sum of g x_hat; the gradient of the input is scale (g - mean(g) - x_hat mean(g x_hat)).
    const auto for_weight = ((product - sum * mean) * rstd).to(torch::kFloat32);
    const auto slope_of_x = scale * rstd * for_weight / static_cast<double>(n);
    const auto constant = scale * sum.to(torch::kFloat32) / static_cast<double>(n) - slope_of_x * mean;
    auto for_input = torch::empty_like(x);
    at::parallel_for(0, c, kChannelGrain, [&](int64_t first, int64_t last) {
      Backward(x.data_ptr<float>(), upstream.data_ptr<float>(), scale.data_ptr<float>(),
               shift.data_ptr<float>(), constant.data_ptr<float>(), slope_of_x.data_ptr<float>(), slope, n, c,
               first, last, for_input.data_ptr<float>());
    });
    return {for_input, for_weight, sum.to(torch::kFloat32), {}, {}, {}};
  }
};

}  // namespace

torch::Tensor NormLeaky(const torch::Tensor& x, torch::nn::BatchNorm1d& norm, double slope) {
  STANCE_CHECK(x.dim() == 2 && x.size(0) > 1 && norm->is_training());
  if (!x.device().is_cpu()) return torch::leaky_relu(norm(x), slope);
  const int64_t n = x.size(0), c = x.size(1);
  auto sum = torch::zeros({c}, torch::kFloat64), square = torch::zeros({c}, torch::kFloat64);
  const auto values = x.detach().contiguous();
  at::parallel_for(0, c, kChannelGrain, [&](int64_t first, int64_t last) {
    Moments(values.data_ptr<float>(), n, c, first, last, sum.data_ptr<double>(), square.data_ptr<double>());
  });
  const auto mean = sum / static_cast<double>(n);
  const auto variance = (square / static_cast<double>(n) - mean.square()).clamp_min(0);
  {
    const torch::NoGradGuard no_grad;
    const double momentum = norm->options.momentum().value_or(0.1);
    norm->running_mean.lerp_(mean.to(torch::kFloat32), momentum);
    norm->running_var.lerp_(
        (variance * (static_cast<double>(n) / static_cast<double>(n - 1))).to(torch::kFloat32), momentum);
    norm->num_batches_tracked.add_(1);
  }
  const auto rstd = (variance + norm->options.eps()).rsqrt().to(torch::kFloat32);
  return NormLeakyFunction::apply(x, norm->weight, norm->bias, mean.to(torch::kFloat32), rstd, slope);
}

}  // namespace stance
