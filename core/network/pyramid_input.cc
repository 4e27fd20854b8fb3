#include "core/network/pyramid_input.h"

#include <algorithm>

#include "core/mesh/geodesic_neighbors.h"

namespace stance {

int64_t RowsOfLevel(int64_t samples, int level) {
  const int64_t step = int64_t{1} << (2 * level);
  return (samples + step - 1) / step;
}

PyramidInput MakePyramidInput(const SurfaceSamples& samples, int threads) {
  PyramidInput input{samples.points, samples.normals, {}};
  const int64_t n = samples.points.rows();
  for (int level = 0; level < kPyramidLevels; ++level) {
    const int64_t queries = RowsOfLevel(n, std::max(0, level - 1)), targets = RowsOfLevel(n, level);
    input.near[level] =
        GeodesicNeighbors(samples.graph, samples.points, 0, queries, targets, kPyramidNeighbors, threads);
  }
  return input;
}

}  // namespace stance
