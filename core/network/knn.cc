#include "core/network/knn.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <limits>
#include <nanoflann.hpp>

#include "core/base/check.h"
#include "core/base/multiversion.h"

namespace stance {
namespace {

// Above this many rows the kd-tree is faster (docs/performance.md has the measurement).
constexpr int64_t kTreeFrom = 4096;
constexpr int kBlock = 16;

// Keeps the k smallest of n values with their indices, ascending: insertion into a short sorted array, with a
// whole block skipped when its minimum can't enter.
STANCE_MULTIVERSION void SelectSmallest(const float* values, int64_t n, int k, float* best, int32_t* index) {
  std::fill(best, best + k, std::numeric_limits<float>::infinity());
  float worst = std::numeric_limits<float>::infinity();
  for (int64_t begin = 0; begin < n; begin += kBlock) {
    const int64_t end = std::min<int64_t>(begin + kBlock, n);
    if (end - begin == kBlock) {
      float lowest = values[begin];
      for (int i = 1; i < kBlock; ++i) lowest = values[begin + i] < lowest ? values[begin + i] : lowest;
      if (!(lowest < worst)) continue;
    }
    for (int64_t i = begin; i < end; ++i) {
      const float value = values[i];
      if (!(value < worst)) continue;
      int slot = k - 1;
      for (; slot > 0 && best[slot - 1] > value; --slot) {
        best[slot] = best[slot - 1];
        index[slot] = index[slot - 1];
      }
      best[slot] = value;
      index[slot] = static_cast<int32_t>(i);
      worst = best[k - 1];
    }
  }
}

// nanoflann's view of a row-major matrix.
struct RowAdaptor {
  const float* data;
  size_t rows;
  size_t channels;
  size_t kdtree_get_point_count() const { return rows; }
  float kdtree_get_pt(size_t row, size_t channel) const { return data[row * channels + channel]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

torch::Tensor KNearestOnDevice(const torch::Tensor& features, int k) {
  const int64_t n = features.size(0);
  auto result = torch::empty({n, k}, features.options().dtype(torch::kInt32));
  constexpr int64_t kRows = 4096;
  for (int64_t begin = 0; begin < n; begin += kRows) {
    const auto queries = features.slice(0, begin, std::min(n, begin + kRows));
    const auto nearest = std::get<1>(torch::cdist(queries, features).topk(k, 1, /*largest=*/false));
    result.slice(0, begin, begin + queries.size(0)).copy_(nearest);
  }
  return result;
}

torch::Tensor KNearestOneMesh(const torch::Tensor& features, int k) {
  const int64_t n = features.size(0);
  const int reach = static_cast<int>(std::min<int64_t>(k, n));
  torch::Tensor nearest;
  if (!features.device().is_cpu()) {
    nearest = KNearestOnDevice(features, reach);
  } else if (n >= kTreeFrom) {
    nearest = KNearestByTree(features, reach);
  } else {
    nearest = KNearestByProduct(features, reach);
  }
  if (reach == k) return nearest;
  const auto self = torch::arange(n, nearest.options()).unsqueeze(1).expand({n, k - reach});
  return torch::cat({nearest, self}, 1);
}

}  // namespace

torch::Tensor KNearestByProduct(const torch::Tensor& features, int k) {
  torch::NoGradGuard no_grad;
  const auto x = features.contiguous();
  const int64_t n = x.size(0);
  STANCE_CHECK(k >= 1 && k <= n);
  const auto squared_norms = x.square().sum(1);
  auto result = torch::empty({n, k}, torch::kInt32);
  int32_t* out = result.data_ptr<int32_t>();
  constexpr int64_t kRows = 256;  // a block of distances stays in the cache
  at::parallel_for(0, (n + kRows - 1) / kRows, 1, [&](int64_t first, int64_t last) {
    torch::NoGradGuard no_grad_here;
    std::vector<float> best(k);
    for (int64_t block = first; block < last; ++block) {
      const int64_t begin = block * kRows, end = std::min(n, begin + kRows);
      // |q - p|^2 without |q|^2, which is the same for a whole row.
      const auto distances = torch::addmm(squared_norms.unsqueeze(0), x.slice(0, begin, end), x.t(), 1, -2);
      const float* d = distances.data_ptr<float>();
      for (int64_t row = begin; row < end; ++row) {
        SelectSmallest(d + (row - begin) * n, n, k, best.data(), out + row * k);
      }
    }
  });
  return result;
}

torch::Tensor KNearestByTree(const torch::Tensor& features, int k) {
  torch::NoGradGuard no_grad;
  const auto x = features.contiguous();
  const int64_t n = x.size(0), channels = x.size(1);
  STANCE_CHECK(k >= 1 && k <= n);
  const RowAdaptor rows{x.data_ptr<float>(), static_cast<size_t>(n), static_cast<size_t>(channels)};
  using Tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Adaptor<float, RowAdaptor>, RowAdaptor, -1, uint32_t>;
  const Tree tree(channels, rows, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  auto result = torch::empty({n, k}, torch::kInt32);
  int32_t* out = result.data_ptr<int32_t>();
  at::parallel_for(0, n, 512, [&](int64_t begin, int64_t end) {
    std::vector<uint32_t> index(k);
    std::vector<float> distance(k);
    for (int64_t row = begin; row < end; ++row) {
      tree.knnSearch(rows.data + row * channels, k, index.data(), distance.data());
      std::copy(index.begin(), index.end(), out + row * k);
    }
  });
  return result;
}

torch::Tensor KNearest(const torch::Tensor& features, const std::vector<int64_t>& offsets, int k) {
  torch::NoGradGuard no_grad;
  const auto x = features.detach();
  std::vector<torch::Tensor> tables(offsets.size() - 1);
  const auto one = [&](int64_t mesh) {
    torch::NoGradGuard no_grad_here;
    tables[mesh] = KNearestOneMesh(x.slice(0, offsets[mesh], offsets[mesh + 1]), k) + offsets[mesh];
  };
  const auto count = static_cast<int64_t>(tables.size());
  if (count > 1 && x.device().is_cpu()) {
    at::parallel_for(0, count, 1, [&](int64_t begin, int64_t end) {
      for (int64_t mesh = begin; mesh < end; ++mesh) one(mesh);
    });
  } else {
    for (int64_t mesh = 0; mesh < count; ++mesh) one(mesh);
  }
  return (tables.size() == 1 ? tables[0] : torch::cat(tables, 0)).to(torch::kInt32);
}

}  // namespace stance
