#include "core/mesh/geodesic_neighbors.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>

#include "core/base/check.h"
#include "core/base/threads.h"

namespace stance {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

// A distance and the row it leads to in one word that compares as the distance does, which is not negative.
using Entry = uint64_t;
Entry MakeEntry(float distance, int32_t row) {
  return static_cast<uint64_t>(std::bit_cast<uint32_t>(distance)) << 32 | static_cast<uint32_t>(row);
}
float DistanceOf(Entry entry) { return std::bit_cast<float>(static_cast<uint32_t>(entry >> 32)); }
int32_t RowOf(Entry entry) { return static_cast<int32_t>(entry & 0xffff'ffffU); }

// Dijkstra's search from one row after another; `distance` is cleared by the rows it touched, not whole.
class NearSearch {
 public:
  explicit NearSearch(const SurfaceGraph& graph) : graph_(graph), distance_(graph.vertex_count(), kFar) {}

  // The up to `k` nearest rows below `targets`, nearest first.
  const std::vector<int32_t>& From(int32_t row, int64_t targets, int k) {
    found_.clear();
    frontier_.clear();
    Reach(row, 0);
    while (!frontier_.empty()) {
      const float reached = DistanceOf(frontier_.front());
      const int32_t v = RowOf(frontier_.front());
      std::pop_heap(frontier_.begin(), frontier_.end(), std::greater<>());
      frontier_.pop_back();
      if (reached > distance_[v]) continue;
      if (v < targets) {
        found_.push_back(v);
        if (static_cast<int>(found_.size()) == k) break;
      }
      for (int32_t e = graph_.start[v]; e < graph_.start[v + 1]; ++e) {
        const float candidate = reached + graph_.length[e];
        if (candidate < distance_[graph_.column[e]]) Reach(graph_.column[e], candidate);
      }
    }
    for (const int32_t v : touched_) distance_[v] = kFar;
    touched_.clear();
    return found_;
  }

 private:
  void Reach(int32_t v, float distance) {
    if (distance_[v] == kFar) touched_.push_back(v);
    distance_[v] = distance;
    frontier_.push_back(MakeEntry(distance, v));
    std::push_heap(frontier_.begin(), frontier_.end(), std::greater<>());
  }

  const SurfaceGraph& graph_;
  std::vector<float> distance_;
  std::vector<int32_t> touched_, found_;
  std::vector<Entry> frontier_;
};

// Fills `row` from `filled` on with the targets nearest in space that are not in it yet.
void FillFromSpace(const Points& points, int32_t query, int64_t targets, int filled, int k, int32_t* row) {
  std::vector<std::pair<float, int32_t>> rest;
  for (int32_t t = 0; t < targets; ++t) {
    if (std::find(row, row + filled, t) != row + filled) continue;
    rest.emplace_back((points.row(t) - points.row(query)).squaredNorm(), t);
  }
  const auto wanted = std::min<size_t>(rest.size(), k - filled);
  std::partial_sort(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(wanted), rest.end());
  for (size_t i = 0; i < wanted; ++i) row[filled++] = rest[i].second;
  std::fill(row + filled, row + k, row[0]);
}

}  // namespace

NeighborTable GeodesicNeighbors(const SurfaceGraph& graph, const Points& points, int64_t first, int64_t last,
                                int64_t targets, int k, int threads) {
  STANCE_CHECK(points.rows() == graph.vertex_count() && 0 <= first && first <= last &&
               last <= points.rows() && targets >= 1 && targets <= points.rows() && k >= 1);
  NeighborTable table(last - first, k);
  ParallelFor(last - first, threads, 64, [&](int64_t begin, int64_t end) {
    NearSearch search(graph);
    for (int64_t query = first + begin; query < first + end; ++query) {
      int32_t* row = table.row(query - first).data();
      const std::vector<int32_t>& found = search.From(static_cast<int32_t>(query), targets, k);
      std::copy(found.begin(), found.end(), row);
      const int filled = static_cast<int>(found.size());
      if (filled < k) FillFromSpace(points, static_cast<int32_t>(query), targets, filled, k, row);
    }
  });
  return table;
}

}  // namespace stance
