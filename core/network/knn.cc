#include "core/network/knn.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <memory>

#include "core/base/check.h"
#include "core/network/row_index.h"

namespace stance {
namespace {

// The rows' own indices in the columns that a mesh of too few rows leaves empty.
void PadWithSelf(torch::Tensor table, int64_t reach) {
  if (reach == table.size(1)) return;
  const auto self = torch::arange(table.size(0), table.options()).unsqueeze(1);
  table.slice(1, reach).copy_(self.expand({table.size(0), table.size(1) - reach}));
}

}  // namespace

torch::Tensor KNearestByTorch(const torch::Tensor& features, int k) {
  torch::NoGradGuard no_grad;
  const int64_t n = features.size(0);
  STANCE_CHECK(k >= 1 && k <= n);
  auto result = torch::empty({n, k}, features.options().dtype(torch::kInt32));
  constexpr int64_t kRows = 4096;  // bounds the memory of the distances
  for (int64_t begin = 0; begin < n; begin += kRows) {
    const auto queries = features.slice(0, begin, std::min(n, begin + kRows));
    const auto nearest = std::get<1>(torch::cdist(queries, features).topk(k, 1, /*largest=*/false));
    result.slice(0, begin, begin + queries.size(0)).copy_(nearest);
  }
  return result;
}

torch::Tensor KNearest(const torch::Tensor& features, const std::vector<int64_t>& offsets, int k) {
  torch::NoGradGuard no_grad;
  STANCE_CHECK(k >= 1 && offsets.size() >= 2);
  const auto x = features.detach().contiguous();
  const auto meshes = static_cast<int64_t>(offsets.size()) - 1;
  auto table = torch::empty({x.size(0), k}, x.options().dtype(torch::kInt32));
  const auto rows_of = [&](int64_t mesh) { return offsets[mesh + 1] - offsets[mesh]; };
  if (!x.device().is_cpu()) {
    for (int64_t mesh = 0; mesh < meshes; ++mesh) {
      const auto reach = static_cast<int>(std::min<int64_t>(k, rows_of(mesh)));
      auto part = table.slice(0, offsets[mesh], offsets[mesh + 1]);
      part.slice(1, 0, reach).copy_(KNearestByTorch(x.slice(0, offsets[mesh], offsets[mesh + 1]), reach));
      PadWithSelf(part, reach);
      part.add_(offsets[mesh]);
    }
    return table;
  }
  // One index a mesh, then all leaves of all meshes as one range, so that few large meshes fill all threads.
  std::vector<std::unique_ptr<RowIndex>> indices(meshes);
  at::parallel_for(0, meshes, 1, [&](int64_t begin, int64_t end) {
    for (int64_t mesh = begin; mesh < end; ++mesh) {
      indices[mesh] = std::make_unique<RowIndex>(x.data_ptr<float>() + offsets[mesh] * x.size(1),
                                                 rows_of(mesh), x.size(1));
    }
  });
  std::vector<int64_t> first_leaf = {0};
  for (const auto& index : indices) first_leaf.push_back(first_leaf.back() + index->leaf_count());
  int32_t* out = table.data_ptr<int32_t>();
  at::parallel_for(0, first_leaf.back(), 8, [&](int64_t begin, int64_t end) {
    for (int64_t mesh = 0; mesh < meshes; ++mesh) {
      const int64_t first = std::max(begin, first_leaf[mesh]), last = std::min(end, first_leaf[mesh + 1]);
      if (first >= last) continue;
      indices[mesh]->Nearest(first - first_leaf[mesh], last - first_leaf[mesh], k,
                             static_cast<int32_t>(offsets[mesh]), out + offsets[mesh] * k);
    }
  });
  return table;
}

}  // namespace stance
