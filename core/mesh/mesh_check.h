// The one place that says whether a caller's mesh can be worked on.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

inline constexpr int64_t kDefaultMaxVertices = 1'000'000;

struct MeshLimits {
  // Most vertices accepted. Raise it where memory allows: a transfer takes about 1 KB per vertex.
  int64_t max_vertices = kDefaultMaxVertices;
  // Most faces accepted; closed triangle meshes have twice as many faces as vertices.
  int64_t max_faces = 4 * kDefaultMaxVertices;
};

// Accepts any count: for files of the caller's own machine.
inline constexpr MeshLimits kNoMeshLimits = {.max_vertices = std::numeric_limits<int64_t>::max(),
                                             .max_faces = std::numeric_limits<int64_t>::max()};

// CheckMesh's refusal of so many vertices and faces, for readers, which know the counts before there is a
// mesh.
absl::Status CheckLimits(int64_t vertices, int64_t faces, const MeshLimits& limits);

// What is odd but workable about a mesh, as sentences for the answer's warnings, e.g.
// "3 degenerate faces (first: face 17)".
struct MeshReport {
  int64_t degenerate_faces = 0;
  int64_t unreferenced_vertices = 0;
  int64_t components = 0;  // connected by shared vertices, unreferenced vertices not counted
  int64_t non_manifold_edges = 0;
  std::vector<std::string> warnings;
};

// INVALID_ARGUMENT, one clear sentence that names the vertex or face and its value, for a mesh without
// vertices, without faces, with a non-finite coordinate (or one beyond +-1e6 m), with a face index out of
// range, of zero extent (all vertices in one point), or beyond the limits. Otherwise the report. A normal or
// texture coordinate that is not finite makes a warning: the pipeline and the writers leave that attribute
// out.
absl::StatusOr<MeshReport> CheckMesh(const TriangleMesh& mesh, const MeshLimits& limits = {});

// Empties normals and texture coordinates that are not all finite, as CheckMesh's warning says.
void DropBrokenAttributes(TriangleMesh& mesh);

}  // namespace stance
