// Collects what a reader finds, face by face, and makes the TriangleMesh of it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

class MeshBuilder {
 public:
  explicit MeshBuilder(const MeshLimits& limits) : limits_(limits) {}

  // CheckMesh's refusal if so many vertices and faces more would exceed the limits. Readers ask before they
  // add.
  absl::Status CheckRoom(int64_t vertices, int64_t faces) const {
    return CheckLimits(vertex_count() + vertices, face_count() + faces, limits_);
  }

  void AddPosition(float x, float y, float z) { positions_.insert(positions_.end(), {x, y, z}); }
  int64_t vertex_count() const { return static_cast<int64_t>(positions_.size()) / 3; }
  int64_t face_count() const { return static_cast<int64_t>(faces_.size()) / 3; }

  // Triangulates as a fan around the first corner. REQUIRES: at least 3 corners.
  void AddPolygon(std::span<const int32_t> corners);

  // The faces added from now on belong to a group of this name; a group without faces leaves no trace. Faces
  // before the first group, if one follows, form an unnamed one.
  void BeginGroup(std::string name);

  // Adds the attributes, which must be flat arrays of 3 (2) floats per vertex, or empty.
  TriangleMesh Finish(std::span<const float> normals = {}, std::span<const float> texcoords = {}) &&;

 private:
  void EndGroup();

  MeshLimits limits_;
  std::vector<float> positions_;
  std::vector<int32_t> faces_;
  std::vector<MeshGroup> groups_;
  std::string group_name_;
  int64_t group_start_ = 0;
  bool grouped_ = false;
};

}  // namespace stance
