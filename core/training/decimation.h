// Coarser triangulations of a mesh on subsets of its own vertices.
#pragma once

#include <vector>

#include "core/base/types.h"
#include "core/training/body_data.h"

namespace stance {

// The whole mesh, then one level for each of `targets` (descending vertex counts): edges are collapsed onto
// one of their ends, least quadric error first and none longer than the level's even spacing, until about
// that many vertices remain. So the vertices stay where they are and the levels are nested. A level that
// can't be reached that way has more vertices; targets above the mesh's own count are left out.
std::vector<BodyTopology> BuildLevels(const Points& vertices, const Faces& faces,
                                      const std::vector<int>& targets);

}  // namespace stance
