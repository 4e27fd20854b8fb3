#include "core/network/sparse_softmax.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/check.h"

namespace stance {
namespace {

using torch::autograd::AutogradContext;
using torch::autograd::tensor_list;

constexpr double kTiny = 1e-10;  // the paper's epsilon
constexpr float kLowest = -std::numeric_limits<float>::infinity();
constexpr int64_t kRowGrain = 256;

// Rows [begin, end) of c entries. `largest`: room for k.
void Rows(const float* logits, int64_t begin, int64_t end, int64_t c, std::vector<float>& largest,
          float* out) {
  for (int64_t v = begin; v < end; ++v) {
    const float* a = logits + v * c;
    float* w = out + v * c;
    std::fill(largest.begin(), largest.end(), kLowest);
    bool number = true;
    for (int64_t j = 0; j < c; ++j) {
      number = number && !std::isnan(a[j]);
      float value = a[j];
      for (float& kept : largest) {
        if (value > kept) std::swap(value, kept);
      }
    }
    const float most = number ? largest.front() : std::numeric_limits<float>::quiet_NaN();
    float sum = 0;
    for (int64_t j = 0; j < c; ++j) {
      // No number less no number is none: minus infinity needs a way of its own.
      w[j] = a[j] < largest.back() || a[j] == kLowest ? 0.0f : std::exp(a[j] - most);
      sum += w[j];
    }
    const float scale = 1 / (sum + static_cast<float>(kTiny));
    for (int64_t j = 0; j < c; ++j) w[j] *= scale;
  }
}

torch::Tensor Weights(const torch::Tensor& logits, int64_t k) {
  const int64_t n = logits.size(0), c = logits.size(1), kept = std::min(k, c);
  if (!logits.device().is_cpu()) {
    const auto largest = std::get<0>(logits.topk(kept, 1));
    const auto shifted = (logits - largest.narrow(1, 0, 1)).exp();
    const auto gone = (logits < largest.narrow(1, kept - 1, 1)).logical_or(logits == kLowest);
    const auto exponentials = shifted.masked_fill(gone, 0);
    return exponentials / (exponentials.sum(1, /*keepdim=*/true) + kTiny);
  }
  const auto a = logits.contiguous();
  auto out = torch::empty_like(a);
  at::parallel_for(0, n, kRowGrain, [&](int64_t begin, int64_t end) {
    std::vector<float> largest(kept);
    Rows(a.data_ptr<float>(), begin, end, c, largest, out.data_ptr<float>());
  });
  return out;
}

struct SparseSoftmaxFunction : torch::autograd::Function<SparseSoftmaxFunction> {
  static torch::Tensor forward(AutogradContext* ctx, const torch::Tensor& logits, int64_t k) {
    const auto weights = Weights(logits, k);
    ctx->save_for_backward({weights});
    return weights;
  }
  static tensor_list backward(AutogradContext* ctx, const tensor_list& grads) {
    const auto weights = ctx->get_saved_variables()[0];
    const auto product = weights * grads[0];
    return {product - weights * product.sum(1, /*keepdim=*/true), torch::Tensor()};
  }
};

}  // namespace

torch::Tensor SparseSoftmax(const torch::Tensor& logits, int64_t k) {
  STANCE_CHECK(logits.dim() == 2 && logits.size(1) >= 1 && k >= 1);
  STANCE_CHECK(logits.scalar_type() == torch::kFloat32);
  return SparseSoftmaxFunction::apply(logits, k);
}

}  // namespace stance
