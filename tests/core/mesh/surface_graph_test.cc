#include "core/mesh/surface_graph.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/meshes.h"

namespace stance {
namespace {

TEST(SurfaceGraph, HasEachEdgeOnceInBothDirections) {
  const TriangleMesh mesh = testing::Icosphere(2);
  const SurfaceGraph graph = BuildSurfaceGraph(mesh.positions, mesh.faces);
  EXPECT_EQ(static_cast<int64_t>(graph.column.size()), 3 * mesh.face_count());  // closed: E = 3F/2
  for (int32_t v = 0; v < graph.vertex_count(); ++v) {
    for (int32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) {
      const int32_t u = graph.column[e];
      EXPECT_NEAR(graph.length[e], (mesh.positions.row(u) - mesh.positions.row(v)).norm(), 1e-6f);
      const std::set<int32_t> back(graph.column.begin() + graph.start[u],
                                   graph.column.begin() + graph.start[u + 1]);
      EXPECT_TRUE(back.contains(v));
    }
  }
}

TEST(SurfaceGraph, IgnoresRepeatedIndices) {
  const TriangleMesh mesh = testing::WithDegenerateFaces();
  const SurfaceGraph graph = BuildSurfaceGraph(mesh.positions, mesh.faces);
  for (int32_t v = 0; v < graph.vertex_count(); ++v) {
    for (int32_t e = graph.start[v]; e < graph.start[v + 1]; ++e) EXPECT_NE(graph.column[e], v);
  }
}

TEST(NearestSeed, CellsOfAStripSplitInTheMiddle) {
  const TriangleMesh strip = testing::Grid(10, 1);  // 11 x 2 vertices over [0, 1]
  const auto cell = NearestSeed(BuildSurfaceGraph(strip.positions, strip.faces), {0, 10});
  for (int v = 0; v < 11; ++v) {
    if (v == 5) continue;  // as far from one as from the other
    EXPECT_EQ(cell[v], v < 5 ? 0 : 1);
  }
}

TEST(NearestSeed, GoesAlongTheSurfaceNotAcrossGaps) {
  // A strip folded like a hairpin: its ends almost touch, but are far along the surface.
  TriangleMesh strip = testing::Grid(40, 1);
  for (int64_t v = 0; v < strip.vertex_count(); ++v) {
    const float s = strip.positions(v, 0);
    const float x = s < 0.5f ? s : 1 - s;
    strip.positions.row(v) << x, strip.positions(v, 1) * 0.05f, s < 0.5f ? 0.0f : 0.01f;
  }
  const auto cell = NearestSeed(BuildSurfaceGraph(strip.positions, strip.faces), {0, 40});
  EXPECT_EQ(cell[5], 0);
  EXPECT_EQ(cell[35], 1);  // 1 cm away from vertex 5 in space
}

TEST(NearestSeed, LeavesUnreachableVerticesWithoutACell) {
  const TriangleMesh two = testing::TwoSpheres(1);
  const auto cell = NearestSeed(BuildSurfaceGraph(two.positions, two.faces), {0});
  const int64_t reached = std::count(cell.begin(), cell.end(), 0);
  EXPECT_EQ(reached * 2, two.vertex_count());
  EXPECT_EQ(std::count(cell.begin(), cell.end(), -1) * 2, two.vertex_count());
}

}  // namespace
}  // namespace stance
