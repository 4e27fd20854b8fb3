// What METHOD_STANCE's network sees of a mesh: samples on three levels with neighbourhoods along the surface.
// Free of Torch.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/types.h"
#include "core/mesh/resample.h"

namespace stance {

inline constexpr int kPyramidLevels = 3;
inline constexpr int kPyramidNeighbors = 16;  // the row itself included
inline constexpr int kCoarseNeighbors = 3;    // between which features are interpolated

// What a network is shown of the samples. Ours see all of it; those that don't show what each is worth.
struct InputFeatures {
  bool normals = true;   // otherwise all are zero
  bool geodesic = true;  // neighbourhoods along the surface; otherwise in space
  bool operator==(const InputFeatures&) const = default;
};

// N samples in farthest-point order. Level l is the first RowsOfLevel(N, l) of them: evenly spread, too.
struct PyramidInput {
  Points points;   // (N, 3) in the mesh's unit; the network normalises them
  Points normals;  // (N, 3) unit, or zero where the surface has none
  // near[l] (rows of level l, 16): the nearest of level l; coarse[l] (rows of level l, 3): the nearest of
  // level l + 1. Nearest first, along the surface (geodesic_neighbors.h) or in space.
  std::array<NeighborTable, kPyramidLevels> near;
  std::array<NeighborTable, kPyramidLevels - 1> coarse;
};

// N, N / 4 and N / 16, rounded up.
int64_t RowsOfLevel(int64_t samples, int level);

PyramidInput MakePyramidInput(const SurfaceSamples& samples, int threads, const InputFeatures& features = {});

}  // namespace stance
