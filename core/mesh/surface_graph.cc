#include "core/mesh/surface_graph.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <utility>

namespace stance {

SurfaceGraph BuildSurfaceGraph(const Points& positions, const Faces& faces) {
  const int64_t vertices = positions.rows();
  SurfaceGraph graph;
  graph.start.assign(vertices + 1, 0);
  // Counting sort of both directions of each face's edges by their first vertex, then sort and thin each row.
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) graph.start[faces(f, corner) + 1] += 2;
  }
  for (int64_t v = 0; v < vertices; ++v) graph.start[v + 1] += graph.start[v];
  std::vector<int32_t> next(graph.start.begin(), graph.start.end() - 1);
  std::vector<int32_t> column(graph.start.back());
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int32_t v = faces(f, corner);
      column[next[v]++] = faces(f, (corner + 1) % 3);
      column[next[v]++] = faces(f, (corner + 2) % 3);
    }
  }
  graph.column.reserve(column.size() / 2);
  int32_t begin = 0;
  for (int64_t v = 0; v < vertices; ++v) {
    const auto first = column.begin() + begin, last = column.begin() + graph.start[v + 1];
    begin = graph.start[v + 1];
    std::sort(first, last);
    graph.start[v] = static_cast<int32_t>(graph.column.size());
    for (auto it = first; it != last; ++it) {
      if (*it == v || (it != first && *it == *(it - 1))) continue;
      graph.column.push_back(*it);
      graph.length.push_back((positions.row(v) - positions.row(*it)).norm());
    }
  }
  graph.start[vertices] = static_cast<int32_t>(graph.column.size());
  return graph;
}

SeedCells NearestSeeds(const SurfaceGraph& graph, const std::vector<int32_t>& seeds) {
  const int64_t vertices = graph.vertex_count();
  SeedCells cells{std::vector<int32_t>(vertices, -1),
                  std::vector<float>(vertices, std::numeric_limits<float>::infinity())};
  std::vector<int32_t>& nearest = cells.seed;
  std::vector<float>& distance = cells.distance;
  using Entry = std::pair<float, int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> frontier;
  for (size_t i = 0; i < seeds.size(); ++i) {
    if (distance[seeds[i]] == 0) continue;
    distance[seeds[i]] = 0;
    nearest[seeds[i]] = static_cast<int32_t>(i);
    frontier.emplace(0.0f, seeds[i]);
  }
  while (!frontier.empty()) {
    const auto [reached, v] = frontier.top();
    frontier.pop();
    if (reached > distance[v]) continue;
    for (int32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
      const int32_t u = graph.column[e];
      const float candidate = reached + graph.length[e];
      if (candidate < distance[u]) {
        distance[u] = candidate;
        nearest[u] = nearest[v];
        frontier.emplace(candidate, u);
      }
    }
  }
  return cells;
}

SurfaceGraph SeedGraph(const SurfaceGraph& graph, const SeedCells& cells, int64_t seed_count) {
  // Calls f(a, b, length) for each edge of `graph` between two cells, in both directions as it stands in both
  // of its rows.
  const auto for_each_border = [&](const auto& f) {
    for (int32_t v = 0; v < graph.vertex_count(); ++v) {
      const int32_t a = cells.seed[v];
      if (a < 0) continue;
      for (int32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
        const int32_t u = graph.column[e], b = cells.seed[u];
        if (b >= 0 && a != b) f(a, b, cells.distance[v] + graph.length[e] + cells.distance[u]);
      }
    }
  };
  // A counting sort by the first cell, then of the few neighbours of each the shortest way.
  std::vector<int32_t> start(seed_count + 1, 0);
  for_each_border([&](int32_t a, int32_t, float) { ++start[a + 1]; });
  for (int64_t s = 0; s < seed_count; ++s) start[s + 1] += start[s];
  using Border = std::pair<int32_t, float>;
  std::vector<Border> borders(start.back());
  std::vector<int32_t> next(start.begin(), start.end() - 1);
  for_each_border([&](int32_t a, int32_t b, float length) { borders[next[a]++] = {b, length}; });

  SurfaceGraph seeds;
  seeds.start.assign(seed_count + 1, 0);
  std::vector<Border> row;
  for (int64_t s = 0; s < seed_count; ++s) {
    row.clear();
    for (int32_t i = start[s]; i < start[s + 1]; ++i) {
      const Border& border = borders[i];
      const auto known = std::find_if(row.begin(), row.end(),
                                      [&](const Border& other) { return other.first == border.first; });
      if (known == row.end()) {
        row.push_back(border);
      } else {
        known->second = std::min(known->second, border.second);
      }
    }
    std::sort(row.begin(), row.end());
    for (const auto& [neighbor, length] : row) {
      seeds.column.push_back(neighbor);
      seeds.length.push_back(length);
    }
    seeds.start[s + 1] = static_cast<int32_t>(seeds.column.size());
  }
  return seeds;
}

}  // namespace stance
