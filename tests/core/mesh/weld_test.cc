#include "core/mesh/weld.h"

#include <gtest/gtest.h>

#include "tests/support/meshes.h"

namespace stance {
namespace {

TEST(WeldVertices, UndoesAnUnwelding) {
  const TriangleMesh sphere = testing::Icosphere(2), soup = testing::Unwelded(sphere);
  const WeldedMesh welded = WeldVertices(soup);
  EXPECT_EQ(welded.mesh.vertex_count(), sphere.vertex_count());
  EXPECT_EQ(welded.mesh.face_count(), sphere.face_count());
  for (int64_t v = 0; v < soup.vertex_count(); ++v) {
    EXPECT_EQ(welded.mesh.positions.row(welded.welded_row[v]), soup.positions.row(v));
  }
}

TEST(WeldVertices, LeavesAWeldedMeshAsItIs) {
  const TriangleMesh box = testing::Box(1, 2, 3);
  const WeldedMesh welded = WeldVertices(box);
  EXPECT_EQ(welded.mesh.positions, box.positions);
  EXPECT_EQ(welded.mesh.faces, box.faces);
}

TEST(WeldVertices, KeepsVerticesThatAreMerelyClose) {
  TriangleMesh two = testing::Box();
  two.positions(1, 0) = two.positions(0, 0) + 1e-4f;
  EXPECT_EQ(WeldVertices(two).mesh.vertex_count(), 8);
}

TEST(WeldVertices, DoesNotDependOnWhereTheMeshStandsNorOnWhatElseItHolds) {
  TriangleMesh mesh = testing::Box();
  mesh.positions(1, 0) = mesh.positions(0, 0) + 1e-6f;
  mesh.positions.conservativeResize(9, 3);
  mesh.positions.row(8) << 1e5f, 0, 0;
  EXPECT_EQ(WeldVertices(mesh).mesh.vertex_count(), 9);
}

TEST(WeldVertices, TakesMinusZeroForZero) {
  TriangleMesh soup = testing::Unwelded(testing::Box());
  for (int64_t v = 0; v < soup.vertex_count(); v += 2) {
    soup.positions.row(v) = (soup.positions.row(v).array() == 0).select(-0.0f, soup.positions.row(v));
  }
  EXPECT_EQ(WeldVertices(soup).mesh.vertex_count(), 8);
}

}  // namespace
}  // namespace stance
