// The edges of a mesh as a graph with lengths, and shortest paths over it.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/types.h"

namespace stance {

// Undirected edges in compressed rows: the neighbours of v are column[start[v]] .. column[start[v + 1] - 1].
struct SurfaceGraph {
  std::vector<int32_t> start;   // V + 1
  std::vector<int32_t> column;  // neighbours, ascending within a row, without repetition
  std::vector<float> length;    // metres, of the same edges

  int64_t vertex_count() const { return static_cast<int64_t>(start.size()) - 1; }
};

SurfaceGraph BuildSurfaceGraph(const Points& positions, const Faces& faces);

// Each vertex's nearest seed along edges (multi-source Dijkstra) as an index into `seeds`, -1 where none can
// be reached: the geodesic Voronoi cells of the seeds.
std::vector<int32_t> NearestSeed(const SurfaceGraph& graph, const std::vector<int32_t>& seeds);

}  // namespace stance
