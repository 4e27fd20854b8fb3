#include "core/mesh/io_builder.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace stance {

void MeshBuilder::AddPolygon(std::span<const int32_t> corners) {
  STANCE_CHECK(corners.size() >= 3);
  for (size_t k = 2; k < corners.size(); ++k) {
    faces_.insert(faces_.end(), {corners[0], corners[k - 1], corners[k]});
  }
}

void MeshBuilder::BeginGroup(std::string name) {
  EndGroup();
  group_name_ = std::move(name);
  grouped_ = true;
}

void MeshBuilder::EndGroup() {
  if (face_count() > group_start_) {
    groups_.push_back({std::move(group_name_), group_start_, face_count() - group_start_});
  }
  group_name_.clear();
  group_start_ = face_count();
}

TriangleMesh MeshBuilder::Finish(std::span<const float> normals, std::span<const float> texcoords) && {
  if (grouped_) EndGroup();
  const int64_t vertices = vertex_count();
  STANCE_CHECK(normals.empty() || static_cast<int64_t>(normals.size()) == 3 * vertices);
  STANCE_CHECK(texcoords.empty() || static_cast<int64_t>(texcoords.size()) == 2 * vertices);

  TriangleMesh mesh;
  mesh.positions.resize(vertices, 3);
  std::copy(positions_.begin(), positions_.end(), mesh.positions.data());
  positions_ = {};
  mesh.faces.resize(face_count(), 3);
  std::copy(faces_.begin(), faces_.end(), mesh.faces.data());
  faces_ = {};
  mesh.normals.resize(normals.empty() ? 0 : vertices, 3);
  std::copy(normals.begin(), normals.end(), mesh.normals.data());
  mesh.texcoords.resize(texcoords.empty() ? 0 : vertices, 2);
  std::copy(texcoords.begin(), texcoords.end(), mesh.texcoords.data());
  mesh.groups = std::move(groups_);
  return mesh;
}

}  // namespace stance
