// The readers and writers behind the dispatcher of mesh_io.h, one file per format.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

// ParseMesh's contract for each format.
absl::StatusOr<TriangleMesh> ParseObj(std::string_view bytes, const MeshLimits& limits = {});
absl::StatusOr<TriangleMesh> ParsePly(std::string_view bytes, const MeshLimits& limits = {});
absl::StatusOr<TriangleMesh> ParseOff(std::string_view bytes, const MeshLimits& limits = {});
absl::StatusOr<TriangleMesh> ParseStl(std::string_view bytes, const MeshLimits& limits = {});
absl::StatusOr<TriangleMesh> ParseGlb(std::string_view bytes, const MeshLimits& limits = {});

// Each REQUIRES a mesh that CheckWritable accepts: finite positions, indices in range, attributes of zero
// or one row per vertex, groups inside the faces and in order.
std::string SerializeObj(const TriangleMesh& mesh);
std::string SerializePly(const TriangleMesh& mesh);  // binary, little-endian
std::string SerializeOff(const TriangleMesh& mesh);
std::string SerializeStl(const TriangleMesh& mesh);  // binary
std::string SerializeGlb(const TriangleMesh& mesh);

// The mesh's groups with the gaps between them filled by unnamed ones: they cover all faces, in order. Empty
// if the mesh has no groups.
std::vector<MeshGroup> CoveringGroups(const TriangleMesh& mesh);

}  // namespace stance
