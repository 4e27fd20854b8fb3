// Farthest-point sampling.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/types.h"

namespace stance {

// Indices of up to `count` rows of `points`, each the farthest from those before it; the first is the
// farthest from the centroid, so the choice does not depend on the rows' order. Stops early when every row
// coincides with a chosen one. Of rows that are equally far, the first is chosen. O(rows * count) at
// worst; blocks of rows that no choice can matter to are passed over.
std::vector<int32_t> FarthestPoints(const Points& points, int64_t count);

}  // namespace stance
