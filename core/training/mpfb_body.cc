#include "core/training/mpfb_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/training/decimation.h"
#include "core/training/mpfb_files.h"
#include "core/training/shape_parameters.h"
#include "core/training/weight_cleanup.h"

namespace stance {
namespace {

using std::filesystem::path;
using Factors = std::vector<uint8_t>;

// The names that file names are made of, by ShapeFactor.
constexpr std::array<std::string_view, kShapeFactorCount> kFactorNames = {
    "male",          "female",     "african",   "asian",         "caucasian",        "child",
    "young",         "old",        "minmuscle", "averagemuscle", "maxmuscle",        "minweight",
    "averageweight", "maxweight",  "minheight", "maxheight",     "idealproportions", "uncommonproportions",
    "mincup",        "averagecup", "maxcup",    "minfirmness",   "averagefirmness",  "maxfirmness"};

constexpr std::array<std::string_view, 11> kLocalSections = {
    "arms", "breast", "buttocks", "feet", "hands", "head", "hip", "legs", "neck", "stomach", "torso"};

// Vertices kept at each end of the body for the stature: enough for every identity's own to be among them.
constexpr int kLowestVertices = 60;
constexpr int kHighestVertices = 20;

// A macro morph's file: its factors' names in order, joined by dashes behind a prefix.
struct MacroFile {
  path file;
  Factors factors;
  bool optional = false;
};

MacroFile MakeMacroFile(const std::string& prefix, Factors factors, bool optional = false) {
  std::string name = prefix;
  for (const uint8_t factor : factors) {
    if (!name.empty() && name.back() != '/') name += '-';
    name += kFactorNames[factor];
  }
  return {name + ".target.gz", std::move(factors), optional};
}

std::vector<MacroFile> MacroFiles() {
  std::vector<MacroFile> files;
  for (const uint8_t gender : {kMale, kFemale}) {
    for (uint8_t age = kChild; age <= kOld; ++age) {
      for (uint8_t ethnicity = kAfrican; ethnicity <= kCaucasian; ++ethnicity) {
        files.push_back(MakeMacroFile("macrodetails/", {ethnicity, gender, age}));
      }
      for (uint8_t muscle = kMinMuscle; muscle <= kMaxMuscle; ++muscle) {
        for (uint8_t weight = kMinWeight; weight <= kMaxWeight; ++weight) {
          const Factors build = {gender, age, muscle, weight};
          const auto with = [&build](std::initializer_list<uint8_t> more) {
            Factors factors = build;
            factors.insert(factors.end(), more);
            return factors;
          };
          files.push_back(MakeMacroFile("macrodetails/universal", build));
          for (const uint8_t height : {kMinHeight, kMaxHeight}) {
            files.push_back(MakeMacroFile("macrodetails/height/", with({height})));
          }
          for (const uint8_t proportions : {kIdealProportions, kUncommonProportions}) {
            files.push_back(MakeMacroFile("macrodetails/proportions/", with({proportions})));
          }
          if (gender == kMale) continue;
          for (uint8_t cup = kMinCup; cup <= kMaxCup; ++cup) {
            for (uint8_t firmness = kMinFirmness; firmness <= kMaxFirmness; ++firmness) {
              // Combinations that the other morphs already show have no file.
              files.push_back(MakeMacroFile("breast/", with({cup, firmness}), true));
            }
          }
        }
      }
    }
  }
  return files;
}

// The (positive, negative) files of the local morph pairs that target.json lists.
absl::StatusOr<std::vector<std::pair<path, path>>> LocalFiles(const path& targets) {
  const path index = targets / "target.json";
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(index));
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object())
    return absl::InvalidArgumentError(fmt::format("{}: not a JSON object", index.string()));
  std::vector<std::pair<path, path>> files;
  for (const std::string_view name : kLocalSections) {
    const std::string section(name);
    const nlohmann::json::json_pointer categories("/" + section + "/categories");
    if (!json.contains(categories)) continue;
    for (const nlohmann::json& category : json[categories]) {
      if (!category.is_object() || !category.contains("opposites")) continue;
      for (const std::string side : {"left", "right", "unsided"}) {
        const auto file = [&](const std::string& sign) -> path {
          const nlohmann::json::json_pointer key("/opposites/" + sign + "-" + side);
          if (!category.contains(key) || !category[key].is_string()) return {};
          const auto morph = category[key].get<std::string>();
          return morph.empty() ? path() : targets / section / (morph + ".target.gz");
        };
        const path positive = file("positive"), negative = file("negative");
        if (!positive.empty() && !negative.empty()) files.emplace_back(positive, negative);
      }
    }
  }
  return files;
}

// Turns values at the base mesh's vertices into values at BodyData's points.
class PointMap {
 public:
  PointMap(const MpfbBase& base, JointVertices joints) : base_(base), joints_(std::move(joints)) {
    std::vector<int32_t> by_height(base.body_vertices);
    std::iota(by_height.begin(), by_height.end(), 0);
    std::sort(by_height.begin(), by_height.end(),
              [&](int a, int b) { return base.vertices(a, 1) < base.vertices(b, 1); });
    const int count = base.body_vertices;
    extremes_.assign(by_height.begin(), by_height.begin() + std::min(kLowestVertices, count));
    extremes_.insert(extremes_.end(), by_height.end() - std::min(kHighestVertices, count), by_height.end());
  }

  Points Map(const Points& values) const {
    Points points(base_.body_vertices + kHumanJoints + static_cast<Eigen::Index>(extremes_.size()), 3);
    points.topRows(base_.body_vertices) = values.topRows(base_.body_vertices);
    Eigen::Index row = base_.body_vertices;
    for (const std::vector<int32_t>& vertices : joints_) {
      Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
      for (const int32_t v : vertices) sum += values.row(v);
      points.row(row++) = sum / static_cast<float>(vertices.size());
    }
    for (const int32_t v : extremes_) points.row(row++) = values.row(v);
    return points;
  }

 private:
  const MpfbBase& base_;
  JointVertices joints_;
  std::vector<int32_t> extremes_;
};

absl::StatusOr<MorphTarget> ReadMorph(const path& file, const MpfbBase& base, const PointMap& map,
                                      Factors factors) {
  STANCE_ASSIGN_OR_RETURN(const Points displacements, ReadMpfbTarget(file, base.vertices.rows()));
  const Points deltas = map.Map(displacements) / kMorphUnit;
  MorphTarget morph;
  morph.factors = std::move(factors);
  for (Eigen::Index p = 0; p < deltas.rows(); ++p) {
    const Eigen::RowVector3f delta = deltas.row(p).array().round();
    if (delta.isZero(0)) continue;
    if (!(delta.cwiseAbs().maxCoeff() < 32767)) {
      return absl::InvalidArgumentError(fmt::format("{}: vertex {} moves more than 3.2 m", file.string(), p));
    }
    morph.points.push_back(static_cast<uint16_t>(p));
    for (int c = 0; c < 3; ++c) morph.deltas.push_back(static_cast<int16_t>(delta[c]));
  }
  return morph;
}

}  // namespace

absl::StatusOr<BodyData> ReadMpfbBody(const path& mpfb_dir) {
  const path rigs = mpfb_dir / "rigs" / "standard", targets = mpfb_dir / "targets";
  STANCE_ASSIGN_OR_RETURN(const MpfbBase base, ReadMpfbBase(mpfb_dir / "3dobjs" / "base.obj"));
  STANCE_ASSIGN_OR_RETURN(JointVertices joints, ReadMpfbJoints(rigs / "rig.mixamo.json", base));
  STANCE_ASSIGN_OR_RETURN(const RowMatrix raw_weights,
                          ReadMpfbWeights(rigs / "weights.mixamo.json", base.body_vertices));

  BodyData body;
  body.vertex_count = base.body_vertices;
  const PointMap map(base, std::move(joints));
  body.points = map.Map(base.vertices);
  const Points vertices = body.points.topRows(body.vertex_count);
  body.weights = CleanWeights(raw_weights, vertices, base.body);

  for (MacroFile& macro : MacroFiles()) {
    const path file = targets / macro.file;
    if (macro.optional && !std::filesystem::exists(file)) continue;
    STANCE_ASSIGN_OR_RETURN(MorphTarget morph, ReadMorph(file, base, map, std::move(macro.factors)));
    body.morphs.push_back(std::move(morph));
  }
  body.macro_count = static_cast<int>(body.morphs.size());
  STANCE_ASSIGN_OR_RETURN(const auto locals, LocalFiles(targets));
  for (const auto& [positive, negative] : locals) {
    for (const path& file : {positive, negative}) {
      STANCE_ASSIGN_OR_RETURN(MorphTarget morph, ReadMorph(file, base, map, {}));
      body.morphs.push_back(std::move(morph));
    }
  }
  // SMPL's vertex count, and two for quick training.
  body.levels = BuildLevels(vertices, base.body, {6890, 3000, 1500});
  STANCE_RETURN_IF_ERROR(CheckBodyData(body));
  return body;
}

}  // namespace stance
