#include "proto/wire/mesh_wire.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <string>

namespace stance {
namespace {

// The arrays are little-endian on the wire and are copied as they are.
static_assert(std::endian::native == std::endian::little);

template <typename Matrix>
void ToBytes(const Matrix& matrix, std::string* bytes) {
  bytes->assign(reinterpret_cast<const char*>(matrix.data()),
                static_cast<size_t>(matrix.size()) * sizeof(typename Matrix::Scalar));
}

absl::Status Prefixed(const char* prefix, const absl::Status& status) {
  return absl::Status(status.code(), fmt::format("{}{}", prefix, std::string(status.message())));
}

// `check` judges the number of rows before they are copied.
template <typename Matrix, typename Check>
absl::StatusOr<Matrix> FromBytes(const std::string& bytes, const char* field, const Check& check) {
  constexpr size_t kRowBytes = Matrix::ColsAtCompileTime * sizeof(typename Matrix::Scalar);
  if (bytes.size() % kRowBytes != 0) {
    return absl::InvalidArgumentError(fmt::format("{}: {} bytes is not a multiple of {}, the size of a row",
                                                  field, bytes.size(), kRowBytes));
  }
  const auto rows = static_cast<Eigen::Index>(bytes.size() / kRowBytes);
  if (const absl::Status status = check(rows); !status.ok()) {
    return Prefixed(field, Prefixed(": ", status));
  }
  Matrix matrix(rows, Matrix::ColsAtCompileTime);
  if (!bytes.empty()) std::memcpy(matrix.data(), bytes.data(), bytes.size());
  return matrix;
}

absl::Status CheckRows(Eigen::Index rows, Eigen::Index vertices) {
  if (rows == 0 || rows == vertices) return absl::OkStatus();
  return absl::InvalidArgumentError(
      fmt::format("{} rows for {} vertices; want none or one each", rows, vertices));
}

}  // namespace

void MeshToArrays(const TriangleMesh& mesh, v1::MeshArrays* arrays) {
  ToBytes(mesh.positions, arrays->mutable_positions());
  // A valid index is not negative, so that int32 and uint32 have the same bytes.
  ToBytes(mesh.faces, arrays->mutable_indices());
  ToBytes(mesh.normals, arrays->mutable_normals());
  ToBytes(mesh.texcoords, arrays->mutable_texcoords());
}

absl::StatusOr<TriangleMesh> MeshFromArrays(const v1::MeshArrays& arrays, const MeshLimits& limits) {
  const auto few_vertices = [&](Eigen::Index rows) { return CheckLimits(rows, 0, limits); };
  const auto few_faces = [&](Eigen::Index rows) { return CheckLimits(0, rows, limits); };
  TriangleMesh mesh;
  STANCE_ASSIGN_OR_RETURN(mesh.positions, FromBytes<Points>(arrays.positions(), "positions", few_vertices));
  STANCE_ASSIGN_OR_RETURN(mesh.faces, FromBytes<Faces>(arrays.indices(), "indices", few_faces));
  const auto one_each = [&](Eigen::Index rows) { return CheckRows(rows, mesh.vertex_count()); };
  STANCE_ASSIGN_OR_RETURN(mesh.normals, FromBytes<Points>(arrays.normals(), "normals", one_each));
  STANCE_ASSIGN_OR_RETURN(mesh.texcoords, FromBytes<TexCoords>(arrays.texcoords(), "texcoords", one_each));
  if (mesh.face_count() > 0) {
    Eigen::Index face, corner;
    const int32_t smallest = mesh.faces.minCoeff(&face, &corner);
    if (smallest < 0) {
      return absl::InvalidArgumentError(
          fmt::format("indices: face {} has index {}, out of range for {} vertices", face,
                      static_cast<uint32_t>(smallest), mesh.vertex_count()));
    }
  }
  return mesh;
}

absl::StatusOr<TriangleMesh> MeshFromWire(const v1::Mesh& mesh, const MeshLimits& limits) {
  switch (mesh.data_case()) {
    case v1::Mesh::kArrays: {
      absl::StatusOr<TriangleMesh> parsed = MeshFromArrays(mesh.arrays(), limits);
      if (!parsed.ok()) return Prefixed("arrays.", parsed.status());
      return parsed;
    }
    case v1::Mesh::kFile: {
      const absl::StatusOr<MeshFormat> format = MeshFormatFromWire(mesh.file().format());
      if (!format.ok()) return Prefixed("file.format: ", format.status());
      absl::StatusOr<TriangleMesh> parsed = ParseMesh(mesh.file().content(), *format, limits);
      if (!parsed.ok()) return Prefixed("file.content: ", parsed.status());
      return parsed;
    }
    case v1::Mesh::DATA_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("data: neither arrays nor file is set");
}

absl::StatusOr<UpAxis> UpAxisFromWire(v1::UpAxis axis) {
  switch (axis) {
    case v1::UP_AXIS_UNSPECIFIED:
    case v1::UP_AXIS_Y:
      return UpAxis::kY;
    case v1::UP_AXIS_X:
      return UpAxis::kX;
    case v1::UP_AXIS_Z:
      return UpAxis::kZ;
    default:
      return absl::InvalidArgumentError(fmt::format("unknown axis {}", static_cast<int>(axis)));
  }
}

v1::UpAxis UpAxisToWire(UpAxis axis) {
  switch (axis) {
    case UpAxis::kX:
      return v1::UP_AXIS_X;
    case UpAxis::kZ:
      return v1::UP_AXIS_Z;
    case UpAxis::kY:
      break;
  }
  return v1::UP_AXIS_Y;
}

absl::StatusOr<MeshFormat> MeshFormatFromWire(v1::MeshFormat format) {
  switch (format) {
    case v1::MESH_FORMAT_OBJ:
      return MeshFormat::kObj;
    case v1::MESH_FORMAT_PLY:
      return MeshFormat::kPly;
    case v1::MESH_FORMAT_OFF:
      return MeshFormat::kOff;
    case v1::MESH_FORMAT_STL:
      return MeshFormat::kStl;
    case v1::MESH_FORMAT_GLB:
      return MeshFormat::kGlb;
    case v1::MESH_FORMAT_UNSPECIFIED:
      return absl::InvalidArgumentError("must be specified");
    default:
      return absl::InvalidArgumentError(fmt::format("unknown format {}", static_cast<int>(format)));
  }
}

v1::MeshFormat MeshFormatToWire(MeshFormat format) {
  switch (format) {
    case MeshFormat::kObj:
      return v1::MESH_FORMAT_OBJ;
    case MeshFormat::kPly:
      return v1::MESH_FORMAT_PLY;
    case MeshFormat::kOff:
      return v1::MESH_FORMAT_OFF;
    case MeshFormat::kStl:
      return v1::MESH_FORMAT_STL;
    case MeshFormat::kGlb:
      return v1::MESH_FORMAT_GLB;
  }
  return v1::MESH_FORMAT_UNSPECIFIED;
}

}  // namespace stance
