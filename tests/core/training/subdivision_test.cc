#include "core/training/subdivision.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>
#include <utility>

#include "core/mesh/measure.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

// Six times the volume inside a closed mesh; negative if it is inside out.
double SixVolumes(const Points& positions, const Faces& faces) {
  double sum = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const auto at = [&](int c) -> Eigen::Vector3d { return positions.row(faces(f, c)).cast<double>(); };
    sum += at(0).dot(at(1).cross(at(2)));
  }
  return sum;
}

std::vector<TriangleMesh> Meshes() {
  return {testing::Icosphere(2), testing::Box(1, 2, 3),          testing::Grid(5, 9),
          testing::Fan(5),       testing::WithDegenerateFaces(), testing::Unwelded(testing::Icosphere(1))};
}

TEST(SubdivideLongestEdges, HasTheCountAndTheArea) {
  for (const TriangleMesh& mesh : Meshes()) {
    for (const int64_t count : {mesh.vertex_count() + 1, 3 * mesh.vertex_count(), int64_t{5000}}) {
      const Subdivision fine = SubdivideLongestEdges(mesh.positions, mesh.faces, count);
      const Points positions = WithMidpoints(mesh.positions, fine.parents);
      EXPECT_EQ(positions.rows(), count);
      EXPECT_EQ(positions.topRows(mesh.vertex_count()), mesh.positions);
      const double area = SurfaceArea(mesh.positions, mesh.faces);
      EXPECT_NEAR(SurfaceArea(positions, fine.faces), area, 1e-4 * area);
    }
  }
}

// A linear function of the position, given at the corners, is that function at every vertex.
TEST(SubdivideLongestEdges, AttributesAreInterpolatedAsPositionsAre) {
  for (const TriangleMesh& mesh : Meshes()) {
    RowMatrix matrix(3, 4);
    matrix << 1, -2, 0.5f, 3, 0.25f, 1, 1, -1, 2, 0, -3, 0.125f;
    const RowMatrix attribute = mesh.positions * matrix;
    const Subdivision fine = SubdivideLongestEdges(mesh.positions, mesh.faces, 2000);
    const Points positions = WithMidpoints(mesh.positions, fine.parents);
    EXPECT_TRUE(WithMidpoints(attribute, fine.parents).isApprox(positions * matrix, 1e-5f));
  }
}

// Every edge between two faces, once in each direction; V - E + F = 2; the same volume, not inside out.
TEST(SubdivideLongestEdges, AClosedSurfaceStaysClosed) {
  for (const TriangleMesh& mesh : {testing::Box(1, 2, 3), testing::Icosphere(1)}) {
    for (const int64_t count : {13, 50, 99, 1234}) {
      const Subdivision fine = SubdivideLongestEdges(mesh.positions, mesh.faces, count);
      const Points positions = WithMidpoints(mesh.positions, fine.parents);
      std::set<std::pair<int, int>> directed;
      for (Eigen::Index f = 0; f < fine.faces.rows(); ++f) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_TRUE(directed.emplace(fine.faces(f, c), fine.faces(f, (c + 1) % 3)).second);
        }
      }
      for (const auto& [a, b] : directed) EXPECT_EQ(directed.count({b, a}), 1u);
      EXPECT_EQ(positions.rows() - std::ssize(directed) / 2 + fine.faces.rows(), 2);
      EXPECT_NEAR(SixVolumes(positions, fine.faces) / SixVolumes(mesh.positions, mesh.faces), 1, 1e-4);
    }
  }
}

// A box of 1 x 1 x 10: its long sides get most of the vertices.
TEST(SubdivideLongestEdges, SpacingBecomesEven) {
  const TriangleMesh mesh = testing::Box(1, 1, 10);
  const Subdivision fine = SubdivideLongestEdges(mesh.positions, mesh.faces, 2000);
  const Points positions = WithMidpoints(mesh.positions, fine.parents);
  float longest = 0;
  for (Eigen::Index f = 0; f < fine.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      longest = std::max(
          longest, (positions.row(fine.faces(f, c)) - positions.row(fine.faces(f, (c + 1) % 3))).norm());
    }
  }
  EXPECT_LT(longest, 0.5f);  // the even spacing is 0.16
}

TEST(SubdivideLongestEdges, EnoughVerticesOrNoEdgeChangeNothing) {
  const TriangleMesh mesh = testing::Icosphere(1);
  for (const int64_t count : {int64_t{0}, mesh.vertex_count()}) {
    const Subdivision same = SubdivideLongestEdges(mesh.positions, mesh.faces, count);
    EXPECT_EQ(same.faces, mesh.faces);
    EXPECT_TRUE(same.parents.empty());
  }
  EXPECT_TRUE(SubdivideLongestEdges(mesh.positions, Faces(0, 3), 1000).parents.empty());
}

}  // namespace
}  // namespace stance
