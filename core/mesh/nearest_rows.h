// Nearest points in space.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/types.h"

namespace stance {

// For each row of `queries`, the index of the nearest row of `points`. REQUIRES: points has rows.
std::vector<int32_t> NearestRow(const Points& queries, const Points& points);

// For each row of `queries`, the k nearest rows of `points`, nearest first; of fewer than k, the last again.
// REQUIRES: points has rows; k >= 1.
NeighborTable NearestRows(const Points& queries, const Points& points, int k);

}  // namespace stance
