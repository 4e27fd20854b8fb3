#include "core/training/body_data.h"

#include <fmt/format.h>

#include <cmath>

#include "core/skeleton/skeleton.h"
#include "core/training/shape_parameters.h"

namespace stance {
namespace {

absl::Status CheckMorph(const MorphTarget& morph, int index, bool macro, int64_t points) {
  if (morph.deltas.size() != 3 * morph.points.size()) {
    return absl::InvalidArgumentError(
        fmt::format("morph {}: {} deltas for {} points", index, morph.deltas.size(), morph.points.size()));
  }
  if (macro == morph.factors.empty()) {
    return absl::InvalidArgumentError(fmt::format("morph {}: {} factors on a {} morph", index,
                                                  morph.factors.size(), macro ? "macro" : "local"));
  }
  for (const uint8_t factor : morph.factors) {
    if (factor >= kShapeFactorCount) {
      return absl::InvalidArgumentError(fmt::format("morph {}: unknown factor {}", index, factor));
    }
  }
  for (size_t i = 0; i < morph.points.size(); ++i) {
    if (morph.points[i] >= points || (i > 0 && morph.points[i] <= morph.points[i - 1])) {
      return absl::InvalidArgumentError(
          fmt::format("morph {}: point {} of {} out of order or range", index, morph.points[i], points));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckLevel(const BodyTopology& level, size_t index, int vertex_count) {
  const auto count = static_cast<int64_t>(level.vertices.size());
  for (int64_t i = 0; i < count; ++i) {
    const int32_t vertex = level.vertices[i];
    if (vertex < 0 || vertex >= vertex_count || (i > 0 && vertex <= level.vertices[i - 1])) {
      return absl::InvalidArgumentError(
          fmt::format("level {}: vertex {} of {} out of order or range", index, vertex, vertex_count));
    }
  }
  if (count == 0 || level.faces.rows() == 0) {
    return absl::InvalidArgumentError(fmt::format("level {}: no vertices or no faces", index));
  }
  if (level.faces.minCoeff() < 0 || level.faces.maxCoeff() >= count) {
    return absl::InvalidArgumentError(
        fmt::format("level {}: face index out of range 0..{}", index, count - 1));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckBodyData(const BodyData& body) {
  const int64_t points = body.points.rows();
  if (body.vertex_count <= 0 || points <= body.vertex_count + kHumanJoints || points > kMaxBodyPoints) {
    return absl::InvalidArgumentError(
        fmt::format("points: {} rows for {} vertices", points, body.vertex_count));
  }
  if (!body.points.allFinite()) return absl::InvalidArgumentError("points: a coordinate is not finite");
  if (body.weights.rows() != body.vertex_count || body.weights.cols() != kHumanJoints) {
    return absl::InvalidArgumentError(fmt::format("weights: {} x {} for {} vertices", body.weights.rows(),
                                                  body.weights.cols(), body.vertex_count));
  }
  for (int v = 0; v < body.vertex_count; ++v) {
    const float sum = body.weights.row(v).sum();
    if (!(body.weights.row(v).minCoeff() >= 0) || !(std::abs(sum - 1) < 1e-3f)) {
      return absl::InvalidArgumentError(fmt::format("weights: vertex {} sums to {}", v, sum));
    }
  }
  const int morphs = static_cast<int>(body.morphs.size());
  if (body.macro_count < 0 || body.macro_count > morphs || (morphs - body.macro_count) % 2 != 0) {
    return absl::InvalidArgumentError(fmt::format("morphs: {} macro morphs of {}", body.macro_count, morphs));
  }
  for (int i = 0; i < morphs; ++i) {
    STANCE_RETURN_IF_ERROR(CheckMorph(body.morphs[i], i, i < body.macro_count, points));
  }
  if (body.levels.empty() || static_cast<int>(body.levels[0].vertices.size()) != body.vertex_count) {
    return absl::InvalidArgumentError("levels: the first is not the whole body");
  }
  for (size_t i = 0; i < body.levels.size(); ++i) {
    STANCE_RETURN_IF_ERROR(CheckLevel(body.levels[i], i, body.vertex_count));
  }
  return absl::OkStatus();
}

}  // namespace stance
