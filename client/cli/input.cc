#include "client/cli/input.h"

#include <fmt/format.h>

#include <limits>

#include "absl/strings/cord.h"
#include "client/cli/exit_code.h"
#include "core/mesh/mesh_io.h"

namespace stance {
namespace {

absl::Status WithPath(const absl::Status& status, const std::string& path) {
  const std::string text(status.message());
  return text.find(path) != std::string::npos ? status : WithText(status, path + ": " + text);
}

}  // namespace

absl::StatusOr<TriangleMesh> ReadInput(const std::string& path) {
  absl::StatusOr<TriangleMesh> mesh = ReadMesh(path);
  if (!mesh.ok()) return WithPath(FileError(mesh.status()), path);
  return mesh;
}

absl::StatusOr<MeshReport> CheckInput(const std::string& path, const TriangleMesh& mesh) {
  MeshLimits limits;
  limits.max_vertices = std::numeric_limits<int64_t>::max();
  limits.max_faces = std::numeric_limits<int64_t>::max();
  absl::StatusOr<MeshReport> report = CheckMesh(mesh, limits);
  if (!report.ok()) return WithPath(report.status(), path);
  return report;
}

absl::Status WithText(const absl::Status& status, const std::string& text) {
  absl::Status renamed(status.code(), text);
  status.ForEachPayload(
      [&](const auto& url, const absl::Cord& payload) { renamed.SetPayload(url, payload); });
  return renamed;
}

absl::Status NameFile(const absl::Status& status,
                      const std::vector<std::pair<std::string, std::string>>& files) {
  const std::string text(status.message());
  for (const auto& [field, path] : files) {
    if (text.starts_with(field + ":") || text.starts_with(field + ".")) {
      return WithText(status, fmt::format("{}: {}", path, text));
    }
  }
  return status;
}

}  // namespace stance
