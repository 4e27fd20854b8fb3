// Readers and writers for OBJ, PLY, OFF, STL and GLB behind one dispatcher.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

enum class MeshFormat { kObj, kPly, kOff, kStl, kGlb };

// The format that a file name's extension or a bare name ("obj", ".OBJ", "character.obj") means.
// INVALID_ARGUMENT, listing the known ones, for any other.
absl::StatusOr<MeshFormat> MeshFormatFromName(std::string_view name);

// The format's lower-case name, which is also its extension: "obj".
std::string_view MeshFormatName(MeshFormat format);

// Reads a mesh from a file's bytes. The vertex order is the file's; polygons are triangulated as fans; the
// parts of a file of several groups or glTF primitives become `groups`. Where a file has texture coordinates
// and normals per corner (OBJ), a vertex takes those of its first corner. STL, which repeats each corner, is
// welded at equal coordinates in the order of first use. GLB node transforms are applied, except to a mesh
// with a skin, whose node has none (glTF 2.0, 3.7.3): it is read as it was bound. Skins, morphs and materials
// are ignored; a GLB's mesh in several primitives is concatenated.
//
// INVALID_ARGUMENT, saying what is wrong and where, for bytes that are not a well-formed file of that format;
// CheckMesh's refusal as soon as more vertices or faces come than `limits` accept. Never crashes or allocates
// more than a small multiple of bytes.size() or of what the limits accept, whichever is less, whatever the
// bytes. The content itself (finite coordinates, indices in range) is for CheckMesh to judge, except that an
// index a reader can't represent is refused here.
absl::StatusOr<TriangleMesh> ParseMesh(std::string_view bytes, MeshFormat format,
                                       const MeshLimits& limits = {});

// The bytes of a file with that mesh. Vertex order, normals, texture coordinates and groups are written where
// the format has them. Coordinates survive a write and a read to within one float32 ulp (text formats print
// nine digits). Normals or texture coordinates that are not all finite are left out. INVALID_ARGUMENT as
// CheckWritable says.
absl::StatusOr<std::string> SerializeMesh(const TriangleMesh& mesh, MeshFormat format);

// What SerializeMesh refuses, INVALID_ARGUMENT: a non-finite coordinate, a face index out of range,
// attributes that don't match the vertices, groups outside the faces or out of order; for a GLB also a mesh
// without faces.
absl::Status CheckWritable(const TriangleMesh& mesh, MeshFormat format);

// The same from and to a file, the format taken from the extension. NOT_FOUND, PERMISSION_DENIED or the
// errors above, with the path in the text. ReadMesh accepts any number of vertices. WriteMesh replaces the
// file at once (write aside, then rename).
absl::StatusOr<TriangleMesh> ReadMesh(const std::filesystem::path& path);
absl::Status WriteMesh(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace stance
