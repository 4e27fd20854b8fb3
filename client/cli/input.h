// Meshes from files, and errors that name the file.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

// ReadMesh, its error made a FileError that begins with the path.
absl::StatusOr<TriangleMesh> ReadInput(const std::string& path);

// CheckMesh without limits on the size, its error beginning with the path.
absl::StatusOr<MeshReport> CheckInput(const std::string& path, const TriangleMesh& mesh);

// The same status, code and payloads, with another text.
absl::Status WithText(const absl::Status& status, const std::string& text);

// The same status, code and payloads, its text "PATH: source: ..." where it begins with the field "source"
// (or "source.…") and `files` has {"source", PATH}.
absl::Status NameFile(const absl::Status& status,
                      const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace stance
