#include "core/network/pyramid_input.h"

#include <numeric>
#include <vector>

#include "core/mesh/geodesic_neighbors.h"
#include "core/mesh/nearest_rows.h"

namespace stance {

int64_t RowsOfLevel(int64_t samples, int level) {
  const int64_t step = int64_t{1} << (2 * level);
  return (samples + step - 1) / step;
}

namespace {

// Neighbourhoods in space.
void AddEuclidean(PyramidInput& input) {
  const int64_t samples = input.points.rows();
  for (int level = 0; level < kPyramidLevels; ++level) {
    const Points points = input.points.topRows(RowsOfLevel(samples, level));
    input.near[level] = NearestRows(points, points, kPyramidNeighbors);
    if (level + 1 == kPyramidLevels) continue;
    const Points kept = input.points.topRows(RowsOfLevel(samples, level + 1));
    input.coarse[level] = NearestRows(points, kept, kCoarseNeighbors);
  }
}

}  // namespace

PyramidInput MakePyramidInput(const SurfaceSamples& samples, int threads, const InputFeatures& features) {
  PyramidInput input{samples.points, samples.normals, {}, {}};
  if (!features.normals) input.normals.setZero();
  if (!features.geodesic) {
    AddEuclidean(input);
    return input;
  }
  SurfaceGraph graph = samples.graph;  // of the level's rows
  for (int level = 0;; ++level) {
    const int64_t rows = graph.vertex_count();
    const Points points = samples.points.topRows(rows);
    input.near[level] = GeodesicNeighbors(graph, points, 0, rows, rows, kPyramidNeighbors, threads);
    if (level + 1 == kPyramidLevels) return input;
    std::vector<int32_t> kept(RowsOfLevel(samples.points.rows(), level + 1));
    std::iota(kept.begin(), kept.end(), 0);
    input.coarse[level] =
        GeodesicNeighbors(graph, points, 0, rows, std::ssize(kept), kCoarseNeighbors, threads);
    graph = SeedGraph(graph, NearestSeeds(graph, kept), std::ssize(kept));
  }
}

}  // namespace stance
