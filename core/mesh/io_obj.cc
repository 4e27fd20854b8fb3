// Wavefront OBJ (Alias, Advanced Visualizer manual, appendix B1): v, vt, vn, f, g and o; all else is skipped.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "core/mesh/io_builder.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_text.h"

namespace stance {
namespace {

constexpr int32_t kNone = -1;

// OBJ gives texture coordinates and normals per corner, TriangleMesh per vertex. Splitting a vertex would
// change the file's vertex count and order, so a vertex takes those of the first corner that has any; a
// corner that comes before its vertex's `v` line doesn't count.
class ObjReader {
 public:
  explicit ObjReader(const MeshLimits& limits) : builder_(limits) {}

  absl::StatusOr<TriangleMesh> Read(std::string_view bytes) {
    LineScanner lines(bytes);
    std::string joined;  // of a line that goes on after a backslash
    while (lines.Next()) {
      line_number_ = lines.number();
      std::string_view line = lines.line();
      if (!line.empty() && line.back() == '\\') {
        joined.assign(line.substr(0, line.size() - 1));
        while (lines.Next()) {
          const bool goes_on = !lines.line().empty() && lines.line().back() == '\\';
          joined += ' ';
          joined += lines.line().substr(0, lines.line().size() - (goes_on ? 1 : 0));
          if (!goes_on) break;
        }
        line = joined;
      }
      STANCE_RETURN_IF_ERROR(ReadStatement(line));
    }
    if (builder_.vertex_count() == 0) return absl::InvalidArgumentError("OBJ: there is no 'v' line");
    STANCE_ASSIGN_OR_RETURN(const std::vector<float> normals,
                            Gather(normal_of_vertex_, normals_, 3, "normal"));
    STANCE_ASSIGN_OR_RETURN(const std::vector<float> texcoords,
                            Gather(texcoord_of_vertex_, texcoords_, 2, "texture coordinate"));
    return std::move(builder_).Finish(normals, texcoords);
  }

 private:
  absl::Status Error(const std::string& text) const {
    return absl::InvalidArgumentError(fmt::format("OBJ: line {}: {}", line_number_, text));
  }

  absl::Status ReadStatement(std::string_view line) {
    const std::string_view keyword = NextWord(line);
    if (keyword == "v") {
      float xyz[3];
      STANCE_RETURN_IF_ERROR(ReadReals(line, 3, 3, xyz));
      STANCE_RETURN_IF_ERROR(builder_.CheckRoom(1, 0));
      builder_.AddPosition(xyz[0], xyz[1], xyz[2]);
    } else if (keyword == "vn") {
      float xyz[3];
      STANCE_RETURN_IF_ERROR(ReadReals(line, 3, 3, xyz));
      normals_.insert(normals_.end(), xyz, xyz + 3);
    } else if (keyword == "vt") {
      float uv[2] = {0, 0};
      STANCE_RETURN_IF_ERROR(ReadReals(line, 1, 2, uv));
      texcoords_.insert(texcoords_.end(), uv, uv + 2);
    } else if (keyword == "f") {
      return ReadFace(line);
    } else if (keyword == "g" || keyword == "o") {
      builder_.BeginGroup(CleanName(Trimmed(line)));
    }
    return absl::OkStatus();
  }

  // Reads `most` numbers, of which `least` must be there; what follows (w, colours) is ignored.
  absl::Status ReadReals(std::string_view line, int least, int most, float* values) const {
    for (int k = 0; k < most; ++k) {
      const std::string_view word = NextWord(line);
      const bool absent = word.empty() || word[0] == '#';
      if (absent && k >= least) break;
      if (absent) return Error(fmt::format("{} numbers expected, {} found", least, k));
      const std::optional<float> value = ParseReal(word);
      if (!value) return Error(fmt::format("{} is not a number", Quoted(word)));
      values[k] = *value;
    }
    return absl::OkStatus();
  }

  // The 0-based index that a 1-based one, or a negative one counted back from the `count` so far, means.
  absl::StatusOr<int32_t> ReadIndex(std::string_view word, int64_t count) const {
    const std::optional<int64_t> written = ParseInteger(word);
    if (!written) return Error(fmt::format("{} is not an index", Quoted(word)));
    const int64_t index = *written > 0 ? *written - 1 : *written + count;
    if (*written == 0 || index < 0 || index > std::numeric_limits<int32_t>::max()) {
      return Error(fmt::format("index {} is out of range ({} defined so far)", *written, count));
    }
    return static_cast<int32_t>(index);
  }

  absl::Status ReadFace(std::string_view line) {
    corners_.clear();
    while (true) {
      std::string_view word = NextWord(line);
      if (word.empty() || word[0] == '#') break;
      std::string_view parts[3];  // vertex, texture coordinate, normal
      for (int k = 0; k < 3; ++k) {
        const size_t slash = std::min(word.find('/'), word.size());
        parts[k] = word.substr(0, slash);
        word.remove_prefix(std::min(slash + 1, word.size()));
      }
      if (!word.empty()) return Error("a corner has more than three indices");
      STANCE_ASSIGN_OR_RETURN(const int32_t vertex, ReadIndex(parts[0], builder_.vertex_count()));
      STANCE_RETURN_IF_ERROR(NoteFirst(parts[1], vertex, std::ssize(texcoords_) / 2, texcoord_of_vertex_));
      STANCE_RETURN_IF_ERROR(NoteFirst(parts[2], vertex, std::ssize(normals_) / 3, normal_of_vertex_));
      corners_.push_back(vertex);
    }
    if (corners_.size() < 3) return Error(fmt::format("a face has {} corners", corners_.size()));
    STANCE_RETURN_IF_ERROR(builder_.CheckRoom(0, std::ssize(corners_) - 2));
    builder_.AddPolygon(corners_);
    return absl::OkStatus();
  }

  // Remembers the attribute index in `word` (if any) for the vertex, unless the vertex has one already.
  absl::Status NoteFirst(std::string_view word, int32_t vertex, int64_t count,
                         std::vector<int32_t>& index_of_vertex) const {
    if (word.empty()) return absl::OkStatus();
    STANCE_ASSIGN_OR_RETURN(const int32_t index, ReadIndex(word, count));
    if (vertex >= builder_.vertex_count()) return absl::OkStatus();
    if (vertex >= std::ssize(index_of_vertex)) index_of_vertex.resize(builder_.vertex_count(), kNone);
    if (index_of_vertex[vertex] == kNone) index_of_vertex[vertex] = index;
    return absl::OkStatus();
  }

  // The attribute of each vertex, zero where it has none; nothing if no vertex has any.
  absl::StatusOr<std::vector<float>> Gather(const std::vector<int32_t>& index_of_vertex,
                                            const std::vector<float>& values, int width,
                                            const char* what) const {
    if (index_of_vertex.empty()) return std::vector<float>();
    std::vector<float> gathered(builder_.vertex_count() * width, 0.0f);
    const int64_t count = std::ssize(values) / width;
    for (int64_t v = 0; v < std::ssize(index_of_vertex); ++v) {
      const int64_t index = index_of_vertex[v];
      if (index == kNone) continue;
      if (index >= count) {
        return absl::InvalidArgumentError(
            fmt::format("OBJ: vertex {} uses {} {}, but only {} are defined", v + 1, what, index + 1, count));
      }
      std::copy_n(values.begin() + index * width, width, gathered.begin() + v * width);
    }
    return gathered;
  }

  MeshBuilder builder_;
  std::vector<float> normals_, texcoords_;  // as listed in the file
  std::vector<int32_t> normal_of_vertex_, texcoord_of_vertex_;
  std::vector<int32_t> corners_;
  int64_t line_number_ = 0;
};

// A backslash at a name's end would join the next line to it.
std::string GroupLine(std::string_view name) {
  std::string clean = CleanName(name);
  while (!clean.empty() && clean.back() == '\\') clean.pop_back();
  return clean.empty() ? "g\n" : fmt::format("g {}\n", clean);
}

}  // namespace

absl::StatusOr<TriangleMesh> ParseObj(std::string_view bytes, const MeshLimits& limits) {
  return ObjReader(limits).Read(bytes);
}

std::string SerializeObj(const TriangleMesh& mesh) {
  std::string text = "# Written by Stance\n";
  const auto out = std::back_inserter(text);
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    fmt::format_to(out, "v {:.9g} {:.9g} {:.9g}\n", mesh.positions(v, 0), mesh.positions(v, 1),
                   mesh.positions(v, 2));
  }
  for (int64_t v = 0; v < mesh.texcoords.rows(); ++v) {
    fmt::format_to(out, "vt {:.9g} {:.9g}\n", mesh.texcoords(v, 0), mesh.texcoords(v, 1));
  }
  for (int64_t v = 0; v < mesh.normals.rows(); ++v) {
    fmt::format_to(out, "vn {:.9g} {:.9g} {:.9g}\n", mesh.normals(v, 0), mesh.normals(v, 1),
                   mesh.normals(v, 2));
  }
  const bool has_texcoords = mesh.texcoords.rows() > 0, has_normals = mesh.normals.rows() > 0;
  const std::vector<MeshGroup> groups = CoveringGroups(mesh);
  auto group = groups.begin();
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    if (group != groups.end() && f == group->first_face) text += GroupLine((group++)->name);
    text += 'f';
    for (int corner = 0; corner < 3; ++corner) {
      const int64_t index = mesh.faces(f, corner) + int64_t{1};
      if (has_texcoords && has_normals) {
        fmt::format_to(out, " {0}/{0}/{0}", index);
      } else if (has_texcoords) {
        fmt::format_to(out, " {0}/{0}", index);
      } else if (has_normals) {
        fmt::format_to(out, " {0}//{0}", index);
      } else {
        fmt::format_to(out, " {}", index);
      }
    }
    text += '\n';
  }
  return text;
}

}  // namespace stance
