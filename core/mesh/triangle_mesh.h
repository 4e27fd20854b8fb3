// The mesh value that every part of Stance passes around.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/types.h"

namespace stance {

// A run of consecutive faces that belong together in the file: an OBJ group, a glTF primitive.
struct MeshGroup {
  std::string name;
  int64_t first_face = 0;
  int64_t face_count = 0;
};

// Triangles over shared vertices. A plain value; nothing in it promises manifoldness, closedness or even
// valid indices: CheckMesh (mesh_check.h) does.
struct TriangleMesh {
  Points positions;
  Faces faces;

  // Kept for output only; no computation of Stance reads them. Zero rows when the file had none; otherwise
  // one row per vertex.
  Points normals;
  TexCoords texcoords;
  std::vector<MeshGroup> groups;

  int64_t vertex_count() const { return positions.rows(); }
  int64_t face_count() const { return faces.rows(); }
};

}  // namespace stance
