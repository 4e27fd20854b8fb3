#include "core/training/mpfb_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "core/base/files.h"
#include "core/mesh/io_text.h"
#include "core/skeleton/bone_names.h"
#include "core/training/gzip.h"

namespace stance {
namespace {

using Json = nlohmann::json;

constexpr float kDecimetre = 0.1f;            // metres: the unit of base.obj and of the targets
constexpr size_t kMaxTargetBytes = 16 << 20;  // the longest of MPFB's targets has half a megabyte
constexpr std::string_view kBonePrefix = "mixamorig:";

// Calls line(text, number) for each line until one returns an error.
template <typename Line>
absl::Status ForEachLine(std::string_view text, Line&& line) {
  for (int number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    STANCE_RETURN_IF_ERROR(line(text.substr(0, end), number));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return absl::OkStatus();
}

absl::Status BadLine(const std::filesystem::path& path, int number, std::string_view line) {
  return absl::InvalidArgumentError(fmt::format("{}:{}: can't read '{}'", path.string(), number, line));
}

std::optional<Eigen::RowVector3f> ParseVector(std::string_view& line) {
  Eigen::RowVector3f vector;
  for (int c = 0; c < 3; ++c) {
    const std::optional<float> value = ParseReal(NextWord(line));
    if (!value) return std::nullopt;
    vector[c] = *value * kDecimetre;
  }
  return vector;
}

// The vertices of a face's "v/vt/vn" words, from 0.
std::optional<std::vector<int32_t>> ParsePolygon(std::string_view line) {
  std::vector<int32_t> corners;
  while (true) {
    const std::string_view word = NextWord(line);
    if (word.empty()) break;
    const std::optional<int64_t> index = ParseInteger(word.substr(0, word.find('/')));
    if (!index || *index < 1 || *index > std::numeric_limits<int32_t>::max()) return std::nullopt;
    corners.push_back(static_cast<int32_t>(*index - 1));
  }
  if (corners.size() < 3) return std::nullopt;
  return corners;
}

absl::StatusOr<Json> ReadJson(const std::filesystem::path& path) {
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return absl::InvalidArgumentError(fmt::format("{}: not JSON", path.string()));
  return json;
}

// The canonical joint that a Mixamo bone's weights go to, the bone without its prefix.
std::optional<int> JointOfBone(std::string_view bone) {
  const std::vector<std::string>& names = HumanBoneNames(BoneNaming::kMixamo);
  for (size_t j = 0; j < names.size(); ++j) {
    if (std::string_view(names[j]).substr(kBonePrefix.size()) == bone) return static_cast<int>(j);
  }
  const bool left = bone.substr(0, 8) == "LeftHand";
  if (!left && bone.substr(0, 9) != "RightHand") return std::nullopt;
  if (bone.find("Thumb") != std::string_view::npos) return left ? kLeftWrist : kRightWrist;
  return left ? kLeftHand : kRightHand;
}

}  // namespace

absl::StatusOr<MpfbBase> ReadMpfbBase(const std::filesystem::path& path) {
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  MpfbBase base;
  std::vector<float> coordinates;
  std::vector<int32_t> body;
  std::string group;
  STANCE_RETURN_IF_ERROR(ForEachLine(text, [&](std::string_view line, int number) -> absl::Status {
    std::string_view rest = line;
    const std::string_view keyword = NextWord(rest);
    if (keyword == "v") {
      const auto vertex = ParseVector(rest);
      if (!vertex) return BadLine(path, number, line);
      coordinates.insert(coordinates.end(), vertex->data(), vertex->data() + 3);
    } else if (keyword == "g") {
      group = std::string(NextWord(rest));
    } else if (keyword == "f") {
      const auto corners = ParsePolygon(rest);
      if (!corners) return BadLine(path, number, line);
      std::vector<int32_t>& members = base.groups[group];
      members.insert(members.end(), corners->begin(), corners->end());
      for (size_t i = 2; group == "body" && i < corners->size(); ++i) {
        body.insert(body.end(), {(*corners)[0], (*corners)[i - 1], (*corners)[i]});
      }
    }
    return absl::OkStatus();
  }));
  const auto count = static_cast<int32_t>(coordinates.size() / 3);
  for (auto& [name, members] : base.groups) {
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
    if (members.back() >= count) {
      return absl::InvalidArgumentError(
          fmt::format("{}: group {} uses vertex {} of {}", path.string(), name, members.back(), count));
    }
  }
  if (body.empty()) return absl::InvalidArgumentError(fmt::format("{}: no group 'body'", path.string()));
  base.body_vertices = static_cast<int>(base.groups["body"].size());
  if (base.groups["body"].back() != base.body_vertices - 1) {
    return absl::InvalidArgumentError(
        fmt::format("{}: the body's vertices are not the first {}", path.string(), base.body_vertices));
  }
  base.vertices = Eigen::Map<const Points>(coordinates.data(), count, 3);
  base.body = Eigen::Map<const Faces>(body.data(), static_cast<Eigen::Index>(body.size() / 3), 3);
  return base;
}

absl::StatusOr<Points> ReadMpfbTarget(const std::filesystem::path& path, int64_t base_vertices) {
  STANCE_ASSIGN_OR_RETURN(const std::string compressed, ReadFile(path));
  absl::StatusOr<std::string> text = Decompress(compressed, kMaxTargetBytes);
  if (!text.ok()) {
    return absl::DataLossError(fmt::format("{}: {}", path.string(), std::string(text.status().message())));
  }
  Points displacements = Points::Zero(base_vertices, 3);
  STANCE_RETURN_IF_ERROR(ForEachLine(*text, [&](std::string_view line, int number) -> absl::Status {
    std::string_view rest = line;
    const std::string_view word = NextWord(rest);
    if (word.empty() || word[0] == '#') return absl::OkStatus();
    const std::optional<int64_t> vertex = ParseInteger(word);
    const auto displacement = ParseVector(rest);
    if (!vertex || *vertex < 0 || *vertex >= base_vertices || !displacement)
      return BadLine(path, number, line);
    displacements.row(*vertex) = *displacement;
    return absl::OkStatus();
  }));
  return displacements;
}

absl::StatusOr<JointVertices> ReadMpfbJoints(const std::filesystem::path& path, const MpfbBase& base) {
  STANCE_ASSIGN_OR_RETURN(const Json json, ReadJson(path));
  JointVertices joints;
  for (int j = 0; j < kHumanJoints; ++j) {
    const std::string& bone = HumanBoneNames(BoneNaming::kMixamo)[j];
    const auto bad = [&](std::string_view what) {
      return absl::InvalidArgumentError(fmt::format("{}: bones/{}/head: {}", path.string(), bone, what));
    };
    const Json::json_pointer pointer(fmt::format("/bones/{}/head", bone));
    if (!json.contains(pointer) || !json[pointer].is_object()) return bad("missing");
    const Json& head = json[pointer];
    const Json strategy = head.value("strategy", Json());
    const Json cube = head.value("cube_name", Json());
    if (strategy == "CUBE" && cube.is_string()) {
      const auto group = base.groups.find(cube.get<std::string>());
      if (group == base.groups.end()) return bad("unknown cube");
      joints[j] = group->second;
    } else if (strategy == "MEAN" || strategy == "VERTEX") {
      const Json indices = strategy == "MEAN" ? head.value("vertex_indices", Json::array())
                                              : Json::array({head.value("vertex_index", Json())});
      for (const Json& index : indices) {
        if (!index.is_number_integer() || index.get<int64_t>() < 0 ||
            index.get<int64_t>() >= base.vertices.rows()) {
          return bad("vertex index out of range");
        }
        joints[j].push_back(index.get<int32_t>());
      }
    }
    if (joints[j].empty()) return bad("no vertices by any known strategy");
  }
  return joints;
}

absl::StatusOr<RowMatrix> ReadMpfbWeights(const std::filesystem::path& path, int body_vertices) {
  STANCE_ASSIGN_OR_RETURN(const Json json, ReadJson(path));
  if (!json.is_object() || !json.contains("weights") || !json["weights"].is_object()) {
    return absl::InvalidArgumentError(fmt::format("{}: no object 'weights'", path.string()));
  }
  RowMatrix weights = RowMatrix::Zero(body_vertices, kHumanJoints);
  for (const auto& [name, influences] : json["weights"].items()) {
    const std::string_view bone =
        std::string_view(name).substr(name.rfind(kBonePrefix, 0) == 0 ? kBonePrefix.size() : 0);
    const std::optional<int> joint = JointOfBone(bone);
    if (!joint) return absl::InvalidArgumentError(fmt::format("{}: unknown bone {}", path.string(), name));
    for (const Json& pair : influences) {
      if (!pair.is_array() || pair.size() != 2 || !pair[0].is_number_integer() || !pair[1].is_number() ||
          pair[0].get<int64_t>() < 0 || !(pair[1].get<double>() >= 0)) {
        return absl::InvalidArgumentError(
            fmt::format("{}: bone {}: bad weight {}", path.string(), name, pair.dump()));
      }
      if (pair[0].get<int64_t>() < body_vertices) {
        weights(pair[0].get<int64_t>(), *joint) += pair[1].get<float>();
      }
    }
  }
  return weights;
}

}  // namespace stance
