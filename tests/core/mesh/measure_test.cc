#include "core/mesh/measure.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/meshes.h"

namespace stance {
namespace {

TEST(SurfaceArea, OfABoxIsItsSides) {
  const TriangleMesh box = testing::Box(1, 2, 3);
  EXPECT_NEAR(SurfaceArea(box.positions, box.faces), 2 * (1 * 2 + 2 * 3 + 1 * 3), 1e-5);
}

TEST(SurfaceArea, OfASphereTendsToFourPi) {
  const TriangleMesh sphere = testing::Icosphere(5, 0.5f);
  EXPECT_NEAR(SurfaceArea(sphere.positions, sphere.faces), std::numbers::pi, 0.005);
}

TEST(VertexAreas, SumToTheArea) {
  for (const TriangleMesh& mesh : {testing::Icosphere(3), testing::Fan(5), testing::WithDegenerateFaces()}) {
    EXPECT_NEAR(VertexAreas(mesh.positions, mesh.faces).sum(), SurfaceArea(mesh.positions, mesh.faces), 1e-6);
  }
}

TEST(EstimateStature, ScalesWithTheBody) {
  const TriangleMesh small = testing::Capsule(1.0f, 0.2f), large = testing::Capsule(2.0f, 0.4f);
  EXPECT_NEAR(EstimateStature(large.positions, large.faces) / EstimateStature(small.positions, small.faces),
              2, 1e-4);
}

TEST(VertexNormals, OfASphereAreItsDirections) {
  const TriangleMesh sphere = testing::Icosphere(4);
  const Points normals = VertexNormals(sphere.positions, sphere.faces);
  for (int64_t v = 0; v < normals.rows(); ++v) EXPECT_GT(normals.row(v).dot(sphere.positions.row(v)), 0.999f);
}

TEST(VertexNormals, OfAVertexWithoutFacesIsZero) {
  TriangleMesh mesh = testing::Box();
  mesh.positions.conservativeResize(9, 3);
  mesh.positions.row(8) << 5, 5, 5;
  EXPECT_EQ(VertexNormals(mesh.positions, mesh.faces).row(8).norm(), 0);
}

}  // namespace
}  // namespace stance
