#include "core/mesh/surface_graph.h"

#include <algorithm>
#include <limits>
#include <queue>

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

std::vector<int32_t> NearestSeed(const SurfaceGraph& graph, const std::vector<int32_t>& seeds) {
  const int64_t vertices = graph.vertex_count();
  std::vector<int32_t> nearest(vertices, -1);
  std::vector<float> distance(vertices, std::numeric_limits<float>::infinity());
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
  return nearest;
}

}  // namespace stance
