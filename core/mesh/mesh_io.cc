#include "core/mesh/mesh_io.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/base/files.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_text.h"

namespace stance {
namespace {

struct FormatName {
  MeshFormat format;
  std::string_view name;
};
constexpr std::array<FormatName, 5> kFormats = {{{MeshFormat::kObj, "obj"},
                                                 {MeshFormat::kPly, "ply"},
                                                 {MeshFormat::kOff, "off"},
                                                 {MeshFormat::kStl, "stl"},
                                                 {MeshFormat::kGlb, "glb"}}};

// The bytes of a GLB are counted in 32 bits; 100 bytes are more than a vertex and its two faces take.
constexpr int64_t kMostGlbVertices = 40'000'000;

absl::Status WithPath(const std::filesystem::path& path, const absl::Status& status) {
  return absl::Status(status.code(), fmt::format("{}: {}", path.string(), std::string(status.message())));
}

}  // namespace

std::vector<MeshGroup> CoveringGroups(const TriangleMesh& mesh) {
  if (mesh.groups.empty()) return {};
  std::vector<MeshGroup> groups;
  int64_t end = 0;
  const auto fill_to = [&](int64_t face) {
    if (face > end) groups.push_back({"", end, face - end});
  };
  for (const MeshGroup& group : mesh.groups) {
    if (group.face_count == 0) continue;
    fill_to(group.first_face);
    groups.push_back(group);
    end = group.first_face + group.face_count;
  }
  fill_to(mesh.face_count());
  return groups;
}

absl::StatusOr<MeshFormat> MeshFormatFromName(std::string_view name) {
  const size_t dot = name.rfind('.');
  const std::string extension = LowerCase(dot == std::string_view::npos ? name : name.substr(dot + 1));
  for (const FormatName& known : kFormats) {
    if (extension == known.name) return known.format;
  }
  return absl::InvalidArgumentError(
      fmt::format("{} names no known mesh format (obj, ply, off, stl, glb)", Quoted(name)));
}

std::string_view MeshFormatName(MeshFormat format) {
  for (const FormatName& known : kFormats) {
    if (format == known.format) return known.name;
  }
  STANCE_CHECK(false);
}

absl::StatusOr<TriangleMesh> ParseMesh(std::string_view bytes, MeshFormat format, const MeshLimits& limits) {
  switch (format) {
    case MeshFormat::kObj:
      return ParseObj(bytes, limits);
    case MeshFormat::kPly:
      return ParsePly(bytes, limits);
    case MeshFormat::kOff:
      return ParseOff(bytes, limits);
    case MeshFormat::kStl:
      return ParseStl(bytes, limits);
    case MeshFormat::kGlb:
      return ParseGlb(bytes, limits);
  }
  STANCE_CHECK(false);
}

absl::Status CheckWritable(const TriangleMesh& mesh, MeshFormat format) {
  const auto refuse = [](const std::string& text) {
    return absl::InvalidArgumentError("mesh to write: " + text);
  };
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    if (!mesh.positions.row(v).allFinite()) {
      return refuse(fmt::format("vertex {} has a non-finite coordinate", v));
    }
  }
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int32_t index = mesh.faces(f, corner);
      if (index < 0 || index >= mesh.vertex_count()) {
        return refuse(
            fmt::format("face {} names vertex {}, but there are {} vertices", f, index, mesh.vertex_count()));
      }
    }
  }
  if (mesh.normals.rows() != 0 && mesh.normals.rows() != mesh.vertex_count()) {
    return refuse(fmt::format("{} normals for {} vertices", mesh.normals.rows(), mesh.vertex_count()));
  }
  if (mesh.texcoords.rows() != 0 && mesh.texcoords.rows() != mesh.vertex_count()) {
    return refuse(
        fmt::format("{} texture coordinates for {} vertices", mesh.texcoords.rows(), mesh.vertex_count()));
  }
  int64_t end = 0;
  for (const MeshGroup& group : mesh.groups) {
    if (group.first_face < end || group.face_count < 0 ||
        group.face_count > mesh.face_count() - group.first_face) {
      return refuse(fmt::format("group {} with {} faces from face {} does not fit into {} faces in order",
                                Quoted(group.name), group.face_count, group.first_face, mesh.face_count()));
    }
    end = group.first_face + group.face_count;
  }
  if (format != MeshFormat::kGlb) return absl::OkStatus();
  if (mesh.vertex_count() == 0 || mesh.face_count() == 0) {
    return refuse("a GLB needs at least one vertex and one face");
  }
  if (mesh.vertex_count() > kMostGlbVertices || mesh.face_count() > 2 * kMostGlbVertices) {
    return refuse(fmt::format("{} vertices and {} faces are too many for a GLB", mesh.vertex_count(),
                              mesh.face_count()));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> SerializeMesh(const TriangleMesh& mesh, MeshFormat format) {
  STANCE_RETURN_IF_ERROR(CheckWritable(mesh, format));
  if (!mesh.normals.allFinite() || !mesh.texcoords.allFinite()) {
    TriangleMesh clean = mesh;
    DropBrokenAttributes(clean);
    return SerializeMesh(clean, format);
  }
  switch (format) {
    case MeshFormat::kObj:
      return SerializeObj(mesh);
    case MeshFormat::kPly:
      return SerializePly(mesh);
    case MeshFormat::kOff:
      return SerializeOff(mesh);
    case MeshFormat::kStl:
      return SerializeStl(mesh);
    case MeshFormat::kGlb:
      return SerializeGlb(mesh);
  }
  STANCE_CHECK(false);
}

absl::StatusOr<TriangleMesh> ReadMesh(const std::filesystem::path& path) {
  STANCE_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatFromName(path.filename().string()));
  STANCE_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path));
  absl::StatusOr<TriangleMesh> mesh = ParseMesh(bytes, format, kNoMeshLimits);
  if (!mesh.ok()) return WithPath(path, mesh.status());
  return mesh;
}

absl::Status WriteMesh(const TriangleMesh& mesh, const std::filesystem::path& path) {
  STANCE_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatFromName(path.filename().string()));
  const absl::StatusOr<std::string> bytes = SerializeMesh(mesh, format);
  if (!bytes.ok()) return WithPath(path, bytes.status());
  return WriteFile(path, *bytes);
}

}  // namespace stance
