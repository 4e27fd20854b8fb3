#include "core/mesh/weld.h"

#include <array>
#include <cmath>
#include <unordered_map>

namespace stance {
namespace {

using Key = std::array<int64_t, 3>;
struct KeyHash {
  size_t operator()(const Key& key) const {
    uint64_t hash = 0;
    for (const int64_t k : key) hash = (hash ^ static_cast<uint64_t>(k)) * 0x9e3779b97f4a7c15ULL;
    return hash ^ (hash >> 32);
  }
};

}  // namespace

WeldedMesh WeldVertices(const TriangleMesh& mesh) {
  const int64_t vertices = mesh.vertex_count();
  WeldedMesh welded;
  welded.welded_row.resize(vertices);
  const Eigen::RowVector3f low = mesh.positions.colwise().minCoeff(),
                           high = mesh.positions.colwise().maxCoeff();
  const double step = std::max(1e-30, 1e-6 * static_cast<double>((high - low).norm()));
  std::unordered_map<Key, int32_t, KeyHash> seen;
  seen.reserve(vertices);
  std::vector<int64_t> kept;
  for (int64_t v = 0; v < vertices; ++v) {
    Key key;
    for (int axis = 0; axis < 3; ++axis) {
      key[axis] = std::llround((static_cast<double>(mesh.positions(v, axis)) - low[axis]) / step);
    }
    const auto [it, fresh] = seen.try_emplace(key, static_cast<int32_t>(kept.size()));
    if (fresh) kept.push_back(v);
    welded.welded_row[v] = it->second;
  }
  welded.mesh.positions.resize(static_cast<int64_t>(kept.size()), 3);
  for (size_t i = 0; i < kept.size(); ++i) {
    welded.mesh.positions.row(static_cast<int64_t>(i)) = mesh.positions.row(kept[i]);
  }
  welded.mesh.faces = mesh.faces.unaryExpr([&](int32_t v) { return welded.welded_row[v]; });
  return welded;
}

}  // namespace stance
