// Meshes between the contract's messages and core's values: what the server and the client share.
#pragma once

#include "core/base/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/mesh_io.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/pipeline.h"
#include "stance/v1/mesh.pb.h"

namespace stance {

// Writes positions, indices, normals and texture coordinates; groups have no place in the arrays. One memcpy
// per array.
void MeshToArrays(const TriangleMesh& mesh, v1::MeshArrays* arrays);

// INVALID_ARGUMENT, the text beginning with the field ("positions: 13 bytes ..."), for an array whose length
// is not a whole number of rows, normals or texture coordinates that are neither empty nor one row per
// vertex, more rows than the limits accept (with CheckMesh's words, before anything is copied), and an index
// beyond 2^31 - 1. Everything else about the content is for CheckMesh to judge; in particular an empty mesh
// is not refused here.
absl::StatusOr<TriangleMesh> MeshFromArrays(const v1::MeshArrays& arrays, const MeshLimits& limits = {});

// The mesh in whichever form it travels. Errors as above, the field being "arrays.positions" or
// "file.content"; INVALID_ARGUMENT at "data" if neither form is set, at "file.format" if it is unspecified or
// unknown.
absl::StatusOr<TriangleMesh> MeshFromWire(const v1::Mesh& mesh, const MeshLimits& limits = {});

// Unspecified means +y. INVALID_ARGUMENT, with the number, for a value this version doesn't know.
absl::StatusOr<UpAxis> UpAxisFromWire(v1::UpAxis axis);
v1::UpAxis UpAxisToWire(UpAxis axis);

// INVALID_ARGUMENT for unspecified and for a value this version doesn't know.
absl::StatusOr<MeshFormat> MeshFormatFromWire(v1::MeshFormat format);
v1::MeshFormat MeshFormatToWire(MeshFormat format);

}  // namespace stance
