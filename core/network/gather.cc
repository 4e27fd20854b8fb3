#include "core/network/gather.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <cstdint>

#include "core/base/check.h"
#include "core/base/lanes.h"
#include "core/base/multiversion.h"

namespace stance {
namespace {

using torch::autograd::AutogradContext;
using torch::autograd::tensor_list;

// All kernels: `a` (., C), `table` rows [begin, end) of K entries.

STANCE_MULTIVERSION void MaxRows(const float* a, const int32_t* table, int64_t begin, int64_t end, int64_t k,
                                 int64_t c, float* out) {
  for (int64_t v = begin; v < end; ++v) {
    float* o = out + v * c;
    const int32_t* row = table + v * k;
    std::copy(a + row[0] * c, a + row[0] * c + c, o);
    for (int64_t j = 1; j < k; ++j) {
      const float* s = a + row[j] * c;
      for (int64_t i = 0; i < c; ++i) o[i] = s[i] > o[i] ? s[i] : o[i];
    }
  }
}

// out = LeakyReLU(out + max), 32 channels at a time so that the maxima stay in registers.
STANCE_MULTIVERSION void AddMaxLeakyRows(const float* a, const int32_t* table, int64_t begin, int64_t end,
                                         int64_t k, int64_t c, float slope, int64_t stride, float* out) {
  for (int64_t v = begin; v < end; ++v) {
    const int32_t* row = table + v * k;
    float* o = out + v * stride;
    int64_t i = 0;
    for (; i + 32 <= c; i += 32) {
      const float* s = a + row[0] * c + i;
      Lanes m0 = LanesAt(s), m1 = LanesAt(s + 8), m2 = LanesAt(s + 16), m3 = LanesAt(s + 24);
      for (int64_t j = 1; j < k; ++j) {
        s = a + row[j] * c + i;
        const Lanes s0 = LanesAt(s), s1 = LanesAt(s + 8), s2 = LanesAt(s + 16), s3 = LanesAt(s + 24);
        m0 = s0 > m0 ? s0 : m0;
        m1 = s1 > m1 ? s1 : m1;
        m2 = s2 > m2 ? s2 : m2;
        m3 = s3 > m3 ? s3 : m3;
      }
      const Lanes most[] = {m0, m1, m2, m3};
      for (int l = 0; l < 4; ++l) {
        const Lanes value = LanesAt(o + i + 8 * l) + most[l];
        LanesAt(o + i + 8 * l) = value > 0 ? value : slope * value;
      }
    }
    for (; i < c; ++i) {
      float most = a[row[0] * c + i];
      for (int64_t j = 1; j < k; ++j) most = std::max(most, a[row[j] * c + i]);
      const float value = o[i] + most;
      o[i] = value > 0 ? value : slope * value;
    }
  }
}

// The maxima and the rows they come from, 32 channels at a time so that both stay in registers.
STANCE_MULTIVERSION void ArgMaxRows(const float* a, const int32_t* table, int64_t begin, int64_t end,
                                    int64_t k, int64_t c, float* out, int32_t* arg) {
  for (int64_t v = begin; v < end; ++v) {
    const int32_t* row = table + v * k;
    float* o = out + v * c;
    int32_t* g = arg + v * c;
    int64_t i = 0;
    for (; i + 32 <= c; i += 32) {
      const float* s = a + row[0] * c + i;
      Lanes m0 = LanesAt(s), m1 = LanesAt(s + 8), m2 = LanesAt(s + 16), m3 = LanesAt(s + 24);
      const IntLanes first = IntLanes{} + row[0];
      IntLanes g0 = first, g1 = first, g2 = first, g3 = first;
      for (int64_t j = 1; j < k; ++j) {
        s = a + row[j] * c + i;
        const IntLanes u = IntLanes{} + row[j];
        const Lanes s0 = LanesAt(s), s1 = LanesAt(s + 8), s2 = LanesAt(s + 16), s3 = LanesAt(s + 24);
        g0 = s0 > m0 ? u : g0, g1 = s1 > m1 ? u : g1, g2 = s2 > m2 ? u : g2, g3 = s3 > m3 ? u : g3;
        m0 = s0 > m0 ? s0 : m0, m1 = s1 > m1 ? s1 : m1, m2 = s2 > m2 ? s2 : m2, m3 = s3 > m3 ? s3 : m3;
      }
      LanesAt(o + i) = m0, LanesAt(o + i + 8) = m1, LanesAt(o + i + 16) = m2, LanesAt(o + i + 24) = m3;
      IntLanesAt(g + i) = g0, IntLanesAt(g + i + 8) = g1, IntLanesAt(g + i + 16) = g2,
                     IntLanesAt(g + i + 24) = g3;
    }
    for (; i < c; ++i) {
      o[i] = a[row[0] * c + i];
      g[i] = row[0];
      for (int64_t j = 1; j < k; ++j) {
        const float value = a[row[j] * c + i];
        if (!(value > o[i])) continue;
        o[i] = value;
        g[i] = row[j];
      }
    }
  }
}

STANCE_MULTIVERSION void SumRows(const float* a, const int32_t* table, int64_t begin, int64_t end, int64_t k,
                                 int64_t c, float* out) {
  for (int64_t v = begin; v < end; ++v) {
    float* o = out + v * c;
    const int32_t* row = table + v * k;
    std::copy(a + row[0] * c, a + row[0] * c + c, o);
    for (int64_t j = 1; j < k; ++j) {
      const float* s = a + row[j] * c;
      for (int64_t i = 0; i < c; ++i) o[i] += s[i];
    }
  }
}

// Scatters touch any row, so threads divide the channels instead: [first, last).
void ScatterToArg(const float* grad, const int32_t* arg, int64_t m, int64_t c, int64_t first, int64_t last,
                  float* out) {
  for (int64_t v = 0; v < m; ++v) {
    const float* g = grad + v * c;
    const int32_t* row = arg + v * c;
    for (int64_t i = first; i < last; ++i) out[row[i] * c + i] += g[i];
  }
}

STANCE_MULTIVERSION void ScatterSum(const float* grad, const int32_t* table, int64_t m, int64_t k, int64_t c,
                                    int64_t first, int64_t last, float* out) {
  for (int64_t v = 0; v < m; ++v) {
    const float* g = grad + v * c;
    for (int64_t j = 0; j < k; ++j) {
      float* o = out + table[v * k + j] * c;
      for (int64_t i = first; i < last; ++i) o[i] += g[i];
    }
  }
}

constexpr int64_t kRowGrain = 256;
constexpr int64_t kChannelGrain = 32;

// Any device but the CPU: plain tensor operations, a block of rows at a time to bound the memory.
torch::Tensor GatherOnDevice(const torch::Tensor& features, const torch::Tensor& table, bool maximum) {
  const auto index = table.to(torch::kInt64);
  const auto gathered =
      features.index_select(0, index.reshape({-1})).reshape({index.size(0), index.size(1), -1});
  return maximum ? std::get<0>(gathered.max(1)) : gathered.sum(1);
}

struct MaxFunction : torch::autograd::Function<MaxFunction> {
  static torch::Tensor forward(AutogradContext* ctx, const torch::Tensor& features,
                               const torch::Tensor& table) {
    const auto a = features.contiguous();
    const int64_t m = table.size(0), k = table.size(1), c = a.size(1);
    auto out = torch::empty({m, c}, a.options());
    auto arg = torch::empty({m, c}, table.options());
    at::parallel_for(0, m, kRowGrain, [&](int64_t begin, int64_t end) {
      ArgMaxRows(a.data_ptr<float>(), table.data_ptr<int32_t>(), begin, end, k, c, out.data_ptr<float>(),
                 arg.data_ptr<int32_t>());
    });
    ctx->save_for_backward({arg});
    ctx->saved_data["rows"] = a.size(0);
    return out;
  }
  static tensor_list backward(AutogradContext* ctx, const tensor_list& grads) {
    const auto arg = ctx->get_saved_variables()[0];
    const auto g = grads[0].contiguous();
    const int64_t m = g.size(0), c = g.size(1);
    auto out = torch::zeros({ctx->saved_data["rows"].toInt(), c}, g.options());
    at::parallel_for(0, c, kChannelGrain, [&](int64_t first, int64_t last) {
      ScatterToArg(g.data_ptr<float>(), arg.data_ptr<int32_t>(), m, c, first, last, out.data_ptr<float>());
    });
    return {out, torch::Tensor()};
  }
};

struct SumFunction : torch::autograd::Function<SumFunction> {
  static torch::Tensor forward(AutogradContext* ctx, const torch::Tensor& features,
                               const torch::Tensor& table) {
    const auto a = features.contiguous();
    const int64_t m = table.size(0), k = table.size(1), c = a.size(1);
    auto out = torch::empty({m, c}, a.options());
    at::parallel_for(0, m, kRowGrain, [&](int64_t begin, int64_t end) {
      SumRows(a.data_ptr<float>(), table.data_ptr<int32_t>(), begin, end, k, c, out.data_ptr<float>());
    });
    ctx->save_for_backward({table});
    ctx->saved_data["rows"] = a.size(0);
    return out;
  }
  static tensor_list backward(AutogradContext* ctx, const tensor_list& grads) {
    const auto table = ctx->get_saved_variables()[0];
    const auto g = grads[0].contiguous();
    const int64_t m = g.size(0), c = g.size(1), k = table.size(1);
    auto out = torch::zeros({ctx->saved_data["rows"].toInt(), c}, g.options());
    at::parallel_for(0, c, kChannelGrain, [&](int64_t first, int64_t last) {
      ScatterSum(g.data_ptr<float>(), table.data_ptr<int32_t>(), m, k, c, first, last, out.data_ptr<float>());
    });
    return {out, torch::Tensor()};
  }
};

// out[v] = sum over j of weights[v, j] a[table[v, j]].
STANCE_MULTIVERSION void WeightedSumRows(const float* a, const int32_t* table, const float* weights,
                                         int64_t begin, int64_t end, int64_t k, int64_t c, float* out) {
  for (int64_t v = begin; v < end; ++v) {
    float* o = out + v * c;
    std::fill(o, o + c, 0.0f);
    for (int64_t j = 0; j < k; ++j) {
      const float* s = a + table[v * k + j] * c;
      const float w = weights[v * k + j];
      for (int64_t i = 0; i < c; ++i) o[i] += w * s[i];
    }
  }
}

STANCE_MULTIVERSION void ScatterWeighted(const float* grad, const int32_t* table, const float* weights,
                                         int64_t m, int64_t k, int64_t c, int64_t first, int64_t last,
                                         float* out) {
  for (int64_t v = 0; v < m; ++v) {
    const float* g = grad + v * c;
    for (int64_t j = 0; j < k; ++j) {
      float* o = out + table[v * k + j] * c;
      const float w = weights[v * k + j];
      for (int64_t i = first; i < last; ++i) o[i] += w * g[i];
    }
  }
}

struct WeightedFunction : torch::autograd::Function<WeightedFunction> {
  static torch::Tensor forward(AutogradContext* ctx, const torch::Tensor& features,
                               const torch::Tensor& table, const torch::Tensor& weights) {
    const auto a = features.contiguous();
    const int64_t m = table.size(0), k = table.size(1), c = a.size(1);
    auto out = torch::empty({m, c}, a.options());
    at::parallel_for(0, m, kRowGrain, [&](int64_t begin, int64_t end) {
      WeightedSumRows(a.data_ptr<float>(), table.data_ptr<int32_t>(), weights.data_ptr<float>(), begin, end,
                      k, c, out.data_ptr<float>());
    });
    ctx->save_for_backward({table, weights});
    ctx->saved_data["rows"] = a.size(0);
    return out;
  }
  static tensor_list backward(AutogradContext* ctx, const tensor_list& grads) {
    const auto saved = ctx->get_saved_variables();
    const auto& table = saved[0];
    const auto& weights = saved[1];
    const auto g = grads[0].contiguous();
    const int64_t m = g.size(0), c = g.size(1), k = table.size(1);
    auto out = torch::zeros({ctx->saved_data["rows"].toInt(), c}, g.options());
    at::parallel_for(0, c, kChannelGrain, [&](int64_t first, int64_t last) {
      ScatterWeighted(g.data_ptr<float>(), table.data_ptr<int32_t>(), weights.data_ptr<float>(), m, k, c,
                      first, last, out.data_ptr<float>());
    });
    return {out, torch::Tensor(), torch::Tensor()};
  }
};

torch::Tensor CheckedTable(const torch::Tensor& features, const torch::Tensor& table) {
  STANCE_CHECK(features.dim() == 2 && table.dim() == 2 && table.size(1) >= 1);
  STANCE_CHECK(features.scalar_type() == torch::kFloat32 && table.scalar_type() == torch::kInt32);
  return table.contiguous();
}

}  // namespace

torch::Tensor GatherMax(const torch::Tensor& features, const torch::Tensor& table) {
  const auto rows = CheckedTable(features, table);
  if (!features.device().is_cpu()) return GatherOnDevice(features, rows, /*maximum=*/true);
  if (torch::GradMode::is_enabled() && features.requires_grad()) return MaxFunction::apply(features, rows);
  const auto a = features.contiguous();
  auto out = torch::empty({rows.size(0), a.size(1)}, a.options());
  at::parallel_for(0, rows.size(0), kRowGrain, [&](int64_t begin, int64_t end) {
    MaxRows(a.data_ptr<float>(), rows.data_ptr<int32_t>(), begin, end, rows.size(1), a.size(1),
            out.data_ptr<float>());
  });
  return out;
}

void AddGatherMaxLeaky(const torch::Tensor& features, const torch::Tensor& table, double slope,
                       torch::Tensor out) {
  const auto rows = CheckedTable(features, table);
  STANCE_CHECK(out.dim() == 2 && out.size(0) == rows.size(0) && out.size(1) == features.size(1));
  if (!features.device().is_cpu()) {
    out.add_(GatherOnDevice(features, rows, /*maximum=*/true));
    torch::leaky_relu_(out, slope);
    return;
  }
  STANCE_CHECK(out.stride(1) == 1);
  const auto a = features.contiguous();
  at::parallel_for(0, rows.size(0), kRowGrain, [&](int64_t begin, int64_t end) {
    AddMaxLeakyRows(a.data_ptr<float>(), rows.data_ptr<int32_t>(), begin, end, rows.size(1), a.size(1),
                    static_cast<float>(slope), out.stride(0), out.data_ptr<float>());
  });
}

torch::Tensor GatherSum(const torch::Tensor& features, const torch::Tensor& table) {
  const auto rows = CheckedTable(features, table);
  if (!features.device().is_cpu()) return GatherOnDevice(features, rows, /*maximum=*/false);
  return SumFunction::apply(features, rows);
}

torch::Tensor GatherWeighted(const torch::Tensor& features, const torch::Tensor& table,
                             const torch::Tensor& weights) {
  const auto rows = CheckedTable(features, table);
  STANCE_CHECK(weights.sizes() == rows.sizes() && weights.scalar_type() == torch::kFloat32);
  if (features.device().is_cpu()) return WeightedFunction::apply(features, rows, weights.contiguous());
  const auto index = rows.to(torch::kInt64).reshape({-1});
  return (features.index_select(0, index).reshape({rows.size(0), rows.size(1), -1}) * weights.unsqueeze(2))
      .sum(1);
}

}  // namespace stance
