// Finer triangulations of the same surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/types.h"

namespace stance {

struct Subdivision {
  Faces faces;
  // Of each added vertex, in order: it lies in the middle between these two, which come before it.
  std::vector<std::array<int32_t, 2>> parents;
};

// Puts vertices into the middles of edges, longer ones first, until there are `count`; each face is cut where
// its edges are, so that the surface and its orientation stay and neighbours keep sharing their edges. A mesh
// with `count` vertices or more, or without an edge, stays as it is.
Subdivision SubdivideLongestEdges(const Points& positions, const Faces& faces, int64_t count);

// The rows of any per-vertex matrix, followed by those of the added vertices: the means of their parents'.
template <class Rows>
Rows WithMidpoints(const Rows& rows, const std::vector<std::array<int32_t, 2>>& parents) {
  Rows all(rows.rows() + static_cast<Eigen::Index>(parents.size()), rows.cols());
  all.topRows(rows.rows()) = rows;
  Eigen::Index next = rows.rows();
  for (const auto& [a, b] : parents) all.row(next++) = (all.row(a) + all.row(b)) * 0.5f;
  return all;
}

}  // namespace stance
