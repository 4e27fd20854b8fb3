// Coarser triangulations of a mesh on subsets of its own vertices.
#pragma once

#include <vector>

#include "core/base/types.h"
#include "core/training/body_data.h"

namespace stance {

// The whole mesh, then one level for each of `targets` (descending vertex counts): the shortest edges are
// collapsed onto one of their ends until about that many vertices remain, so the vertices stay where they
// are, the levels are nested and the density becomes even. A level that can't be reached without breaking
// the surface has more vertices; targets above the mesh's own count are left out.
std::vector<BodyTopology> BuildLevels(const Points& vertices, const Faces& faces,
                                      const std::vector<int>& targets);

}  // namespace stance
