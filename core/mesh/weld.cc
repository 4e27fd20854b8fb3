#include "core/mesh/weld.h"

#include <bit>

#include "absl/container/flat_hash_map.h"

namespace stance {

std::array<uint32_t, 3> PositionKey(const float* xyz) {
  std::array<uint32_t, 3> key;
  // Adding zero turns -0 into +0, its equal.
  for (int axis = 0; axis < 3; ++axis) key[axis] = std::bit_cast<uint32_t>(xyz[axis] + 0.0f);
  return key;
}

WeldedMesh WeldVertices(const TriangleMesh& mesh) {
  const int64_t vertices = mesh.vertex_count();
  WeldedMesh welded;
  welded.welded_row.resize(vertices);
  absl::flat_hash_map<std::array<uint32_t, 3>, int32_t> seen;
  seen.reserve(vertices);
  std::vector<int64_t> kept;
  for (int64_t v = 0; v < vertices; ++v) {
    const auto [place, fresh] =
        seen.try_emplace(PositionKey(mesh.positions.row(v).data()), static_cast<int32_t>(kept.size()));
    if (fresh) kept.push_back(v);
    welded.welded_row[v] = place->second;
  }
  welded.mesh.positions.resize(static_cast<int64_t>(kept.size()), 3);
  for (size_t i = 0; i < kept.size(); ++i) {
    welded.mesh.positions.row(static_cast<int64_t>(i)) = mesh.positions.row(kept[i]);
  }
  welded.mesh.faces = mesh.faces.unaryExpr([&](int32_t v) { return welded.welded_row[v]; });
  return welded;
}

}  // namespace stance
