#include "core/training/body_data.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/skeleton/skeleton.h"
#include "core/training/shape_parameters.h"

namespace stance {
namespace {

BodyData Triangle() {
  BodyData body;
  body.vertex_count = 3;
  body.points = Points::Random(3 + kHumanJoints + 2, 3);
  body.weights = RowMatrix::Zero(3, kHumanJoints);
  body.weights.col(kPelvis).setOnes();
  body.morphs = {{{kMale}, {0, 2}, {1, 2, 3, 4, 5, 6}}, {{}, {1}, {1, 1, 1}}, {{}, {1}, {-1, -1, -1}}};
  body.macro_count = 1;
  body.levels.resize(1);
  body.levels[0].vertices = {0, 1, 2};
  body.levels[0].faces.resize(1, 3);
  body.levels[0].faces << 0, 1, 2;
  return body;
}

TEST(BodyData, ConsistentDataPass) { EXPECT_TRUE(CheckBodyData(Triangle()).ok()); }

TEST(BodyData, EachInconsistencyIsNamed) {
  const std::vector<std::pair<std::string, std::function<void(BodyData&)>>> cases = {
      {"points", [](BodyData& b) { b.points.conservativeResize(3 + kHumanJoints, 3); }},
      {"points", [](BodyData& b) { b.vertex_count = 0; }},
      {"not finite", [](BodyData& b) { b.points(1, 1) = std::numeric_limits<float>::quiet_NaN(); }},
      {"weights", [](BodyData& b) { b.weights.conservativeResize(2, kHumanJoints); }},
      {"vertex 1 sums", [](BodyData& b) { b.weights(1, kPelvis) = 0.5f; }},
      {"vertex 1 sums", [](BodyData& b) { b.weights(1, kPelvis) = 2, b.weights(1, kHead) = -1; }},
      {"macro morphs", [](BodyData& b) { b.macro_count = 2; }},
      {"macro morphs", [](BodyData& b) { b.macro_count = -1; }},
      {"morph 0", [](BodyData& b) { b.morphs[0].factors.clear(); }},
      {"unknown factor", [](BodyData& b) { b.morphs[0].factors = {kShapeFactorCount}; }},
      {"morph 1", [](BodyData& b) { b.morphs[1].factors = {kMale}; }},
      {"deltas", [](BodyData& b) { b.morphs[0].deltas.pop_back(); }},
      {"point 99", [](BodyData& b) { b.morphs[0].points[1] = 99; }},
      {"point 0", [](BodyData& b) { b.morphs[0].points[1] = 0; }},
      {"levels", [](BodyData& b) { b.levels.clear(); }},
      {"levels", [](BodyData& b) { b.levels[0].vertices.pop_back(); }},
      {"vertex 7", [](BodyData& b) { b.levels[0].vertices[2] = 7; }},
      {"face index", [](BodyData& b) { b.levels[0].faces(0, 1) = 3; }},
      {"face index", [](BodyData& b) { b.levels[0].faces(0, 1) = -1; }},
      {"no faces", [](BodyData& b) { b.levels[0].faces.resize(0, 3); }}};
  for (const auto& [fragment, damage] : cases) {
    BodyData body = Triangle();
    damage(body);
    const absl::Status status = CheckBodyData(body);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << fragment;
    EXPECT_NE(std::string(status.message()).find(fragment), std::string::npos) << status;
  }
}

}  // namespace
}  // namespace stance
