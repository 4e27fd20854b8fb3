#include "core/training/decimation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "tests/support/meshes.h"

namespace stance {
namespace {

TEST(BuildLevels, LevelsAreNestedSubsetsOfAboutTheTarget) {
  const TriangleMesh mesh = testing::Capsule(1.0f, 0.25f, 40, 16, 40);
  const auto levels = BuildLevels(mesh.positions, mesh.faces, {1000, 300});
  ASSERT_EQ(levels.size(), 3u);
  EXPECT_EQ(static_cast<int64_t>(levels[0].vertices.size()), mesh.vertex_count());
  EXPECT_EQ(levels[0].faces, mesh.faces);
  EXPECT_NEAR(levels[1].vertices.size(), 1000, 1);
  EXPECT_NEAR(levels[2].vertices.size(), 300, 1);
  for (size_t i = 1; i < levels.size(); ++i) {
    EXPECT_TRUE(std::is_sorted(levels[i].vertices.begin(), levels[i].vertices.end()));
    EXPECT_TRUE(std::includes(levels[i - 1].vertices.begin(), levels[i - 1].vertices.end(),
                              levels[i].vertices.begin(), levels[i].vertices.end()));
  }
}

// Every edge between two faces, once in each direction, and Euler's V - E + F = 2: still a closed sphere.
TEST(BuildLevels, AClosedSurfaceStaysClosed) {
  const TriangleMesh mesh = testing::Icosphere(4);
  const auto levels = BuildLevels(mesh.positions, mesh.faces, {400});
  ASSERT_EQ(levels.size(), 2u);
  const Faces& faces = levels[1].faces;
  std::set<std::pair<int, int>> directed;
  std::set<int> used;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(directed.emplace(faces(f, c), faces(f, (c + 1) % 3)).second);
      used.insert(faces(f, c));
    }
  }
  for (const auto& [a, b] : directed) EXPECT_EQ(directed.count({b, a}), 1u);
  EXPECT_EQ(used.size(), levels[1].vertices.size());
  EXPECT_EQ(static_cast<int64_t>(used.size()) - static_cast<int64_t>(directed.size()) / 2 + faces.rows(), 2);
}

TEST(BuildLevels, SpacingIsEven) {
  const TriangleMesh mesh = testing::Icosphere(4);
  const auto levels = BuildLevels(mesh.positions, mesh.faces, {400});
  float shortest = 9, longest = 0;
  for (Eigen::Index f = 0; f < levels[1].faces.rows(); ++f) {
    const auto at = [&](int c) { return mesh.positions.row(levels[1].vertices[levels[1].faces(f, c)]); };
    const float length = (at(0) - at(1)).norm();
    shortest = std::min(shortest, length);
    longest = std::max(longest, length);
  }
  EXPECT_LT(longest / shortest, 8);
  EXPECT_LT(longest, 0.6f);  // the even spacing is 0.19
}

TEST(BuildLevels, TargetsAboveTheMeshAreLeftOut) {
  const TriangleMesh mesh = testing::Icosphere(1);
  EXPECT_EQ(BuildLevels(mesh.positions, mesh.faces, {6890, 3000}).size(), 1u);
}

}  // namespace
}  // namespace stance
