// Object File Format (Geomview): [ST][C][N]OFF in text, one vertex and one face per line. Colours are
// skipped.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "core/mesh/io_builder.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_text.h"

namespace stance {
namespace {

class OffReader {
 public:
  OffReader(std::string_view bytes, const MeshLimits& limits) : lines_(bytes), builder_(limits) {}

  absl::StatusOr<TriangleMesh> Read() {
    STANCE_RETURN_IF_ERROR(ReadHeader());
    for (int64_t v = 0; v < vertices_; ++v) STANCE_RETURN_IF_ERROR(ReadVertex(v));
    for (int64_t f = 0; f < faces_; ++f) STANCE_RETURN_IF_ERROR(ReadFace(f));
    return std::move(builder_).Finish(normals_, texcoords_);
  }

 private:
  absl::Status Error(const std::string& text) const {
    return absl::InvalidArgumentError(fmt::format("OFF: line {}: {}", lines_.number(), text));
  }

  // Moves to the next line that holds anything but blanks and comments; false at the end.
  bool NextLine() {
    while (lines_.Next()) {
      line_ = Trimmed(lines_.line().substr(0, lines_.line().find('#')));
      if (!line_.empty()) return true;
    }
    return false;
  }

  static bool Take(std::string_view& text, std::string_view prefix) {
    if (!text.starts_with(prefix)) return false;
    text.remove_prefix(prefix.size());
    return true;
  }

  // The keyword, and the counts behind it or on the next line.
  absl::Status ReadHeader() {
    if (!NextLine()) return absl::InvalidArgumentError("OFF: the file is empty");
    has_texcoords_ = Take(line_, "ST");
    Take(line_, "C");
    has_normals_ = Take(line_, "N");
    if (!Take(line_, "OFF")) {
      return Error(fmt::format("[ST][C][N]OFF expected, {} found", Quoted(lines_.line())));
    }
    line_ = Trimmed(line_);
    if (line_.starts_with("BINARY")) return Error("binary OFF is not supported");
    if (line_.empty() && !NextLine()) return Error("the file ends before the counts");
    for (int64_t* count : {&vertices_, &faces_}) {
      const std::string_view word = NextWord(line_);
      const std::optional<int64_t> value = ParseInteger(word);
      if (!value || *value < 0) return Error(fmt::format("{} is not a count", Quoted(word)));
      *count = *value;
    }
    return absl::OkStatus();
  }

  absl::Status ReadReals(std::string_view& text, int count, float* values) const {
    for (int k = 0; k < count; ++k) {
      const std::string_view word = NextWord(text);
      const std::optional<float> value = ParseReal(word);
      if (!value) return Error(fmt::format("{} is not a number", Quoted(word)));
      values[k] = *value;
    }
    return absl::OkStatus();
  }

  absl::Status ReadVertex(int64_t v) {
    if (!NextLine()) return Error(fmt::format("the file ends after {} of {} vertices", v, vertices_));
    float xyz[3];
    STANCE_RETURN_IF_ERROR(ReadReals(line_, 3, xyz));
    STANCE_RETURN_IF_ERROR(builder_.CheckRoom(1, 0));
    builder_.AddPosition(xyz[0], xyz[1], xyz[2]);
    if (has_normals_) {
      STANCE_RETURN_IF_ERROR(ReadReals(line_, 3, xyz));
      normals_.insert(normals_.end(), xyz, xyz + 3);
    }
    if (has_texcoords_) {
      // The last two words: between them and the normal may stand a colour of three or four numbers.
      size_t at = line_.size();
      for (int k = 0; k < 2 && at != std::string_view::npos; ++k) {
        at = line_.find_last_of(" \t", line_.find_last_not_of(" \t", at == 0 ? 0 : at - 1));
      }
      std::string_view last_two = line_.substr(at == std::string_view::npos ? 0 : at);
      float uv[2];
      STANCE_RETURN_IF_ERROR(ReadReals(last_two, 2, uv));
      texcoords_.insert(texcoords_.end(), uv, uv + 2);
    }
    return absl::OkStatus();
  }

  absl::Status ReadFace(int64_t f) {
    if (!NextLine()) return Error(fmt::format("the file ends after {} of {} faces", f, faces_));
    const std::string_view count_word = NextWord(line_);
    const std::optional<int64_t> count = ParseInteger(count_word);
    if (!count || *count < 3) {
      return Error(fmt::format("a face of {} corners (at least 3 expected)", Quoted(count_word)));
    }
    corners_.clear();
    for (int64_t k = 0; k < *count; ++k) {
      const std::string_view word = NextWord(line_);
      if (word.empty()) return Error(fmt::format("{} corners announced, {} found", *count, k));
      const std::optional<int64_t> index = ParseInteger(word);
      if (!index || *index < std::numeric_limits<int32_t>::min() ||
          *index > std::numeric_limits<int32_t>::max()) {
        return Error(fmt::format("{} is not an index", Quoted(word)));
      }
      corners_.push_back(static_cast<int32_t>(*index));
    }
    STANCE_RETURN_IF_ERROR(builder_.CheckRoom(0, *count - 2));
    builder_.AddPolygon(corners_);
    return absl::OkStatus();
  }

  LineScanner lines_;
  std::string_view line_;  // what is left of the current line, without comment
  bool has_normals_ = false, has_texcoords_ = false;
  int64_t vertices_ = 0, faces_ = 0;  // as announced
  MeshBuilder builder_;
  std::vector<float> normals_, texcoords_;
  std::vector<int32_t> corners_;
};

}  // namespace

absl::StatusOr<TriangleMesh> ParseOff(std::string_view bytes, const MeshLimits& limits) {
  return OffReader(bytes, limits).Read();
}

std::string SerializeOff(const TriangleMesh& mesh) {
  const bool has_texcoords = mesh.texcoords.rows() > 0, has_normals = mesh.normals.rows() > 0;
  std::string text = fmt::format("{}{}OFF\n{} {} 0\n", has_texcoords ? "ST" : "", has_normals ? "N" : "",
                                 mesh.vertex_count(), mesh.face_count());
  const auto out = std::back_inserter(text);
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    fmt::format_to(out, "{:.9g} {:.9g} {:.9g}", mesh.positions(v, 0), mesh.positions(v, 1),
                   mesh.positions(v, 2));
    if (has_normals) {
      fmt::format_to(out, " {:.9g} {:.9g} {:.9g}", mesh.normals(v, 0), mesh.normals(v, 1),
                     mesh.normals(v, 2));
    }
    if (has_texcoords) fmt::format_to(out, " {:.9g} {:.9g}", mesh.texcoords(v, 0), mesh.texcoords(v, 1));
    text += '\n';
  }
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    fmt::format_to(out, "3 {} {} {}\n", mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2));
  }
  return text;
}

}  // namespace stance
