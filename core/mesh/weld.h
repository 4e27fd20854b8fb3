// Vertices that coincide made one, for computation only.
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace stance {

struct WeldedMesh {
  TriangleMesh mesh;                // positions and faces only; welded vertices in order of first appearance
  std::vector<int32_t> welded_row;  // (V) the welded vertex of each original one
};

// Joins vertices whose coordinates agree to within about a millionth of the bounding box: files split
// vertices at texture seams, and a seam must not tear when it bends. Faces keep their count and order.
WeldedMesh WeldVertices(const TriangleMesh& mesh);

}  // namespace stance
