// Vertices that coincide made one, for computation only.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace stance {

// The three coordinates as a key: equal for equal coordinates, -0 being equal to 0. REQUIRES: no NaN.
std::array<uint32_t, 3> PositionKey(const float* xyz);

struct WeldedMesh {
  TriangleMesh mesh;                // positions and faces only; welded vertices in order of first appearance
  std::vector<int32_t> welded_row;  // (V) the welded vertex of each original one
};

// Joins vertices whose coordinates are equal: files split vertices at texture seams, and a seam must not tear
// when it bends. Without a tolerance: what is merely close stays apart, whatever else the mesh holds and
// wherever it stands. Faces keep their count and order.
WeldedMesh WeldVertices(const TriangleMesh& mesh);

}  // namespace stance
