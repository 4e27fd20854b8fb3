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

// The geodesic Voronoi cells of seeds.
struct SeedCells {
  std::vector<int32_t>
      seed;  // (V) each vertex's nearest seed as an index into the seeds, -1 if none is reached
  std::vector<float> distance;  // (V) metres along edges to it, infinite if none is reached
};

// Multi-source Dijkstra over the edges.
SeedCells NearestSeeds(const SurfaceGraph& graph, const std::vector<int32_t>& seeds);

// The seeds as the vertices of a graph of their own: an edge where two cells touch, as long as the shortest
// path between their seeds that crosses the border once. Distances over it are those over `graph`, or a
// little more where the shortest path crosses a third cell.
SurfaceGraph SeedGraph(const SurfaceGraph& graph, const SeedCells& cells, int64_t seed_count);

}  // namespace stance
