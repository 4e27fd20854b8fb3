// Neighbourhoods along the surface: samples of two limbs that touch are close in space and far along it.
#pragma once

#include <cstdint>

#include "core/base/types.h"
#include "core/mesh/surface_graph.h"

namespace stance {

// (last - first, k): for each row first .. last - 1 of `points` the k nearest of the first `targets` rows
// along `graph` (of resample.h), nearest first; a row that is a target itself begins with itself. Where fewer
// can be reached (a component of its own), the nearest in space among the rest follow; where there are fewer
// than k targets, the nearest one fills the row. REQUIRES: points has a row for each vertex of the graph; 0
// <= first <= last <= rows; 1 <= targets <= rows; k >= 1.
NeighborTable GeodesicNeighbors(const SurfaceGraph& graph, const Points& points, int64_t first, int64_t last,
                                int64_t targets, int k, int threads);

}  // namespace stance
