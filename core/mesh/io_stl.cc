// STL (3D Systems, 1988), binary and text. Each facet repeats its corners; they are welded here.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "absl/container/flat_hash_map.h"
#include "core/mesh/io_builder.h"
#include "core/mesh/io_bytes.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_text.h"
#include "core/mesh/weld.h"

namespace stance {
namespace {

constexpr size_t kHeaderBytes = 84;  // a comment of 80 bytes and the count
constexpr size_t kFacetBytes = 50;   // normal, three corners, two bytes of attributes

// Gives equal coordinates one vertex, numbered in the order of first use.
class Welder {
 public:
  explicit Welder(MeshBuilder& builder) : builder_(builder) {}

  int32_t VertexAt(const float* xyz) {
    const auto [place, added] =
        vertex_of_.try_emplace(PositionKey(xyz), static_cast<int32_t>(builder_.vertex_count()));
    if (added) builder_.AddPosition(xyz[0], xyz[1], xyz[2]);
    return place->second;
  }

 private:
  MeshBuilder& builder_;
  absl::flat_hash_map<std::array<uint32_t, 3>, int32_t> vertex_of_;
};

absl::StatusOr<TriangleMesh> ParseBinary(std::string_view bytes, uint32_t count, const MeshLimits& limits) {
  MeshBuilder builder(limits);
  STANCE_RETURN_IF_ERROR(builder.CheckRoom(0, count));
  Welder welder(builder);
  for (uint32_t f = 0; f < count; ++f) {
    const char* const facet = bytes.data() + kHeaderBytes + f * kFacetBytes;
    std::array<int32_t, 3> corners;
    for (int corner = 0; corner < 3; ++corner) {
      float xyz[3];
      for (int axis = 0; axis < 3; ++axis) {
        xyz[axis] = LoadLittleEndian<float>(facet + 12 + 12 * corner + 4 * axis);
      }
      corners[corner] = welder.VertexAt(xyz);
    }
    STANCE_RETURN_IF_ERROR(builder.CheckRoom(0, 1));
    builder.AddPolygon(corners);
  }
  return std::move(builder).Finish();
}

class TextReader {
 public:
  TextReader(std::string_view bytes, const MeshLimits& limits)
      : bytes_(bytes), rest_(bytes), builder_(limits) {}

  absl::StatusOr<TriangleMesh> Read() {
    while (!Trimmed(rest_).empty()) STANCE_RETURN_IF_ERROR(ReadSolid());
    return std::move(builder_).Finish();
  }

 private:
  absl::Status Error(const std::string& text) const {
    const std::string_view read = bytes_.substr(0, bytes_.size() - rest_.size());
    const int64_t line = 1 + std::count(read.begin(), read.end(), '\n');
    return absl::InvalidArgumentError(fmt::format("STL: line {}: {}", line, text));
  }

  absl::Status Expect(std::string_view keyword) {
    const std::string_view word = NextWord(rest_);
    if (LowerCase(word.substr(0, 16)) == keyword) return absl::OkStatus();
    return Error(word.empty() ? fmt::format("the file ends where '{}' is expected", keyword)
                              : fmt::format("'{}' expected, {} found", keyword, Quoted(word)));
  }

  absl::Status ReadReals(float* xyz) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = NextWord(rest_);
      const std::optional<float> value = ParseReal(word);
      if (!value) return Error(fmt::format("{} is not a number", Quoted(word)));
      xyz[axis] = *value;
    }
    return absl::OkStatus();
  }

  // The rest of the line that the last word stands on.
  std::string_view RestOfLine() {
    const size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    const std::string_view line = Trimmed(rest_.substr(0, end));
    rest_.remove_prefix(end);
    return line;
  }

  absl::Status ReadSolid() {
    STANCE_RETURN_IF_ERROR(Expect("solid"));
    if (const std::string_view name = RestOfLine(); !name.empty() || solids_ > 0) {
      builder_.BeginGroup(CleanName(name));
    }
    ++solids_;
    while (true) {
      std::string_view ahead = rest_;
      if (LowerCase(NextWord(ahead).substr(0, 16)) == "endsolid") {
        rest_ = ahead;
        RestOfLine();
        return absl::OkStatus();
      }
      STANCE_RETURN_IF_ERROR(ReadFacet());
    }
  }

  absl::Status ReadFacet() {
    float normal[3];  // the corners' order says the same
    STANCE_RETURN_IF_ERROR(Expect("facet"));
    STANCE_RETURN_IF_ERROR(Expect("normal"));
    STANCE_RETURN_IF_ERROR(ReadReals(normal));
    STANCE_RETURN_IF_ERROR(Expect("outer"));
    STANCE_RETURN_IF_ERROR(Expect("loop"));
    std::array<int32_t, 3> corners;
    for (int32_t& corner : corners) {
      float xyz[3];
      STANCE_RETURN_IF_ERROR(Expect("vertex"));
      STANCE_RETURN_IF_ERROR(ReadReals(xyz));
      corner = welder_.VertexAt(xyz);
    }
    STANCE_RETURN_IF_ERROR(Expect("endloop"));
    STANCE_RETURN_IF_ERROR(Expect("endfacet"));
    STANCE_RETURN_IF_ERROR(builder_.CheckRoom(0, 1));
    builder_.AddPolygon(corners);
    return absl::OkStatus();
  }

  std::string_view bytes_, rest_;
  MeshBuilder builder_;
  Welder welder_{builder_};
  int64_t solids_ = 0;
};

}  // namespace

absl::StatusOr<TriangleMesh> ParseStl(std::string_view bytes, const MeshLimits& limits) {
  // Binary files often begin with "solid", too: the size tells the two apart.
  if (bytes.size() >= kHeaderBytes) {
    const uint32_t count = LoadLittleEndian<uint32_t>(bytes.data() + 80);
    if (bytes.size() == kHeaderBytes + kFacetBytes * count) return ParseBinary(bytes, count, limits);
  }
  std::string_view rest = bytes;
  if (LowerCase(NextWord(rest).substr(0, 16)) == "solid") return TextReader(bytes, limits).Read();
  if (bytes.size() < kHeaderBytes) {
    return absl::InvalidArgumentError(
        fmt::format("STL: {} bytes are neither a text file nor a binary header", bytes.size()));
  }
  return absl::InvalidArgumentError(
      fmt::format("STL: the header announces {} facets, which does not fit the file's {} bytes",
                  LoadLittleEndian<uint32_t>(bytes.data() + 80), bytes.size()));
}

std::string SerializeStl(const TriangleMesh& mesh) {
  std::string bytes = "Binary STL, written by Stance";
  bytes.resize(kHeaderBytes - 4, ' ');
  bytes.reserve(kHeaderBytes + kFacetBytes * mesh.face_count());
  AppendLittleEndian(static_cast<uint32_t>(mesh.face_count()), bytes);
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    const auto corner = [&](int k) { return mesh.positions.row(mesh.faces(f, k)); };
    const Eigen::RowVector3f ab = corner(1) - corner(0), ac = corner(2) - corner(0);
    const Eigen::RowVector3f normal = ab.cross(ac).stableNormalized();
    for (int axis = 0; axis < 3; ++axis) AppendLittleEndian(normal[axis], bytes);
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) AppendLittleEndian(corner(k)[axis], bytes);
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

}  // namespace stance
