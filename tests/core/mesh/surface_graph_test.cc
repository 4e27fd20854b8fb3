#include "core/mesh/surface_graph.h"

#include <gtest/gtest.h>

#include <set>

#include "core/mesh/farthest_point.h"
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

TEST(NearestSeeds, CellsOfAStripSplitInTheMiddle) {
  const TriangleMesh strip = testing::Grid(10, 1);  // 11 x 2 vertices over [0, 1]
  const auto cell = NearestSeeds(BuildSurfaceGraph(strip.positions, strip.faces), {0, 10}).seed;
  for (int v = 0; v < 11; ++v) {
    if (v == 5) continue;  // as far from one as from the other
    EXPECT_EQ(cell[v], v < 5 ? 0 : 1);
  }
}

TEST(NearestSeeds, GoesAlongTheSurfaceNotAcrossGaps) {
  // A strip folded like a hairpin: its ends almost touch, but are far along the surface.
  TriangleMesh strip = testing::Grid(40, 1);
  for (int64_t v = 0; v < strip.vertex_count(); ++v) {
    const float s = strip.positions(v, 0);
    const float x = s < 0.5f ? s : 1 - s;
    strip.positions.row(v) << x, strip.positions(v, 1) * 0.05f, s < 0.5f ? 0.0f : 0.01f;
  }
  const auto cell = NearestSeeds(BuildSurfaceGraph(strip.positions, strip.faces), {0, 40}).seed;
  EXPECT_EQ(cell[5], 0);
  EXPECT_EQ(cell[35], 1);  // 1 cm away from vertex 5 in space
}

TEST(NearestSeeds, LeavesUnreachableVerticesWithoutACell) {
  const TriangleMesh two = testing::TwoSpheres(1);
  const auto cell = NearestSeeds(BuildSurfaceGraph(two.positions, two.faces), {0}).seed;
  const int64_t reached = std::count(cell.begin(), cell.end(), 0);
  EXPECT_EQ(reached * 2, two.vertex_count());
  EXPECT_EQ(std::count(cell.begin(), cell.end(), -1) * 2, two.vertex_count());
}

TEST(SeedGraph, DistancesAreThoseOverTheSurface) {
  const TriangleMesh sphere = testing::Icosphere(4);
  const SurfaceGraph surface = BuildSurfaceGraph(sphere.positions, sphere.faces);
  const std::vector<int32_t> seeds = FarthestPoints(sphere.positions, 150);
  const SeedCells cells = NearestSeeds(surface, seeds);
  const SurfaceGraph graph = SeedGraph(surface, cells, std::ssize(seeds));
  ASSERT_EQ(graph.vertex_count(), std::ssize(seeds));
  const auto distances = [](const SurfaceGraph& over, int32_t from) {
    return NearestSeeds(over, {from}).distance;
  };
  for (const int32_t from : {0, 20, 77}) {
    const auto exact = distances(surface, seeds[from]), coarse = distances(graph, from);
    for (size_t s = 0; s < seeds.size(); ++s) {
      EXPECT_GE(coarse[s], exact[seeds[s]] - 1e-5f);
      EXPECT_LE(coarse[s], 1.3f * exact[seeds[s]] + 1e-5f) << from << " to " << s;
    }
  }
}

TEST(SeedGraph, EveryVertexASeedGivesTheGraphItself) {
  const TriangleMesh mesh = testing::Box(1, 2, 3);
  const SurfaceGraph surface = BuildSurfaceGraph(mesh.positions, mesh.faces);
  const std::vector<int32_t> seeds = {0, 1, 2, 3, 4, 5, 6, 7};
  const SurfaceGraph graph = SeedGraph(surface, NearestSeeds(surface, seeds), 8);
  EXPECT_EQ(graph.start, surface.start);
  EXPECT_EQ(graph.column, surface.column);
  EXPECT_EQ(graph.length, surface.length);
}

}  // namespace
}  // namespace stance
