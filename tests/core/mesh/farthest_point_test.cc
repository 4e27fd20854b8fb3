#include "core/mesh/farthest_point.h"

#include <gtest/gtest.h>

#include <set>

#include "core/base/random.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using testing::Icosphere;

TEST(FarthestPoints, AreDistinctAndCoverEvenly) {
  const Points points = Icosphere(4).positions;  // 2,562 points
  const auto chosen = FarthestPoints(points, 200);
  ASSERT_EQ(chosen.size(), 200u);
  EXPECT_EQ(std::set<int32_t>(chosen.begin(), chosen.end()).size(), 200u);
  // Greedy cover: every point is nearer to its closest choice than any two choices are to each other.
  float radius = 0, gap = 10;
  for (int64_t v = 0; v < points.rows(); ++v) {
    float nearest = 10;
    for (const int32_t c : chosen) nearest = std::min(nearest, (points.row(v) - points.row(c)).norm());
    radius = std::max(radius, nearest);
  }
  for (size_t i = 0; i < chosen.size(); ++i) {
    for (size_t j = 0; j < i; ++j)
      gap = std::min(gap, (points.row(chosen[i]) - points.row(chosen[j])).norm());
  }
  EXPECT_LE(radius, gap + 1e-6f);
}

TEST(FarthestPoints, DoNotDependOnTheOrderOfTheRows) {
  // An ellipsoid without symmetries, so that no two distances tie.
  TriangleMesh mesh = Icosphere(3);
  mesh.positions = mesh.positions * Eigen::Vector3f(1, 1.37f, 0.71f).asDiagonal();
  for (int64_t v = 0; v < mesh.vertex_count(); ++v)
    mesh.positions(v, 0) +=
        0.05f * mesh.positions(v, 1) * mesh.positions(v, 2) + 0.01f * mesh.positions(v, 1);
  std::vector<int32_t> order;
  const TriangleMesh shuffled = testing::Shuffled(mesh, 5, &order);
  const auto a = FarthestPoints(mesh.positions, 50), b = FarthestPoints(shuffled.positions, 50);
  // As sets: rounding may swap two rows that are all but equally far.
  std::set<int32_t> mapped;
  for (const int32_t row : a) mapped.insert(order[row]);
  EXPECT_EQ(mapped, std::set<int32_t>(b.begin(), b.end()));
}

TEST(FarthestPoints, AreTheDefinitions) {
  TriangleMesh mesh = Icosphere(4);
  mesh.positions = mesh.positions * Eigen::Vector3f(0.4f, 1.7f, 0.2f).asDiagonal();
  Random random(3, 0);
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {  // no ties
    for (int axis = 0; axis < 3; ++axis)
      mesh.positions(v, axis) += 0.02f * static_cast<float>(random.Normal());
  }
  const Points& points = mesh.positions;
  for (const int64_t rows : {int64_t{1}, int64_t{63}, int64_t{64}, int64_t{65}, points.rows()}) {
    const Points own = points.topRows(rows);
    const auto chosen = FarthestPoints(own, 150);
    ASSERT_EQ(std::ssize(chosen), std::min<int64_t>(rows, 150));
    Eigen::VectorXf distance = (own.rowwise() - own.row(chosen[0])).rowwise().norm();
    for (size_t i = 1; i < chosen.size(); ++i) {
      EXPECT_NEAR(distance[chosen[i]], distance.maxCoeff(), 1e-6f) << i << " of " << rows;
      distance = distance.cwiseMin((own.rowwise() - own.row(chosen[i])).rowwise().norm());
    }
  }
}

TEST(FarthestPoints, StopWhereEveryRowCoincidesWithAChoice) {
  Points points(6, 3);
  points << 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0;
  EXPECT_EQ(FarthestPoints(points, 6).size(), 2u);
  EXPECT_TRUE(FarthestPoints(Points(0, 3), 6).empty());
}

}  // namespace
}  // namespace stance
