#include "core/mesh/geodesic_neighbors.h"

#include <gtest/gtest.h>

#include <set>

#include "core/mesh/resample.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

NeighborTable Neighbors(const SurfaceSamples& samples, int64_t targets, int k, int threads = 1) {
  return GeodesicNeighbors(samples.graph, samples.points, 0, samples.points.rows(), targets, k, threads);
}

TEST(GeodesicNeighbors, BeginWithTheRowItselfAndDescendInDistance) {
  const SurfaceSamples samples = ResampleSurface(testing::Icosphere(5), {256, 12});
  const NeighborTable near = Neighbors(samples, 256, 16);
  for (int32_t s = 0; s < 256; ++s) {
    EXPECT_EQ(near(s, 0), s);
    EXPECT_EQ(std::set<int32_t>(near.row(s).begin(), near.row(s).end()).size(), 16u);
    const std::vector<float> distance = NearestSeeds(samples.graph, {s}).distance;
    for (int k = 1; k < 16; ++k) EXPECT_GE(distance[near(s, k)], distance[near(s, k - 1)]);
    // No row that was left out is nearer than the last that was taken.
    int nearer = 0;
    for (const float d : distance) nearer += d < distance[near(s, 15)];
    EXPECT_LE(nearer, 15);
  }
}

TEST(GeodesicNeighbors, OnASphereAreNearlyThoseInSpace) {
  const SurfaceSamples samples = ResampleSurface(testing::Icosphere(5), {256, 12});
  const NeighborTable near = Neighbors(samples, 256, 16);
  for (int32_t s = 0; s < 256; ++s) {
    // 16 of 256 samples cover a cap of chord 2 sqrt(16 / 256).
    const float reach = 1.2f * 2 * std::sqrt(16.0f / 256);
    for (int k = 0; k < 16; ++k) {
      EXPECT_LT((samples.points.row(near(s, k)) - samples.points.row(s)).norm(), reach);
    }
  }
}

TEST(GeodesicNeighbors, StayOnTheirOwnSideOfAGap) {
  const SurfaceSamples samples = ResampleSurface(testing::TwoPlates(20, 0.01f), {400, 12});
  const NeighborTable near = Neighbors(samples, 400, 16);
  for (int64_t s = 0; s < 400; ++s) {
    for (int k = 0; k < 16; ++k) EXPECT_EQ(samples.points(near(s, k), 2), samples.points(s, 2));
  }
}

TEST(GeodesicNeighbors, AComponentThatIsTooSmallIsFilledFromSpace) {
  TriangleMesh mesh = testing::Icosphere(4);
  const int64_t vertices = mesh.vertex_count(), faces = mesh.face_count();
  const TriangleMesh crumb = testing::Icosphere(0, 0.05f);
  mesh.positions.conservativeResize(vertices + crumb.vertex_count(), 3);
  mesh.positions.bottomRows(crumb.vertex_count()) =
      crumb.positions.rowwise() + Eigen::RowVector3f(1.3f, 0, 0);
  mesh.faces.conservativeResize(faces + crumb.face_count(), 3);
  mesh.faces.bottomRows(crumb.face_count()) = crumb.faces.array() + static_cast<int32_t>(vertices);
  const SurfaceSamples samples = ResampleSurface(mesh, {200, 12});
  const NeighborTable near = Neighbors(samples, 200, 16);
  int on_crumb = 0;
  for (int64_t s = 0; s < 200; ++s) {
    EXPECT_EQ(std::set<int32_t>(near.row(s).begin(), near.row(s).end()).size(), 16u);
    if (samples.points(s, 0) < 1.2f) continue;
    ++on_crumb;
    for (int k = 0; k < 16; ++k) EXPECT_GT(samples.points(near(s, k), 0), 0.5f) << "not the nearest in space";
  }
  EXPECT_GT(on_crumb, 0);
  EXPECT_LT(on_crumb, 16);
}

TEST(GeodesicNeighbors, CoarserTargetsAreThePrefix) {
  const SurfaceSamples samples = ResampleSurface(testing::Capsule(), {256, 12});
  const NeighborTable near = Neighbors(samples, 64, 8), all = Neighbors(samples, 256, 256);
  for (int64_t s = 0; s < 256; ++s) {
    // The first eight of the whole order that are targets.
    int k = 0;
    for (int i = 0; k < 8; ++i) {
      if (all(s, i) >= 64) continue;
      EXPECT_EQ(near(s, k), all(s, i));
      ++k;
    }
  }
}

TEST(GeodesicNeighbors, ThreadsAndRangesDoNotMatter) {
  const SurfaceSamples samples = ResampleSurface(testing::Capsule(), {256, 12});
  const NeighborTable near = Neighbors(samples, 256, 16);
  EXPECT_EQ(Neighbors(samples, 256, 16, 3), near);
  EXPECT_EQ(GeodesicNeighbors(samples.graph, samples.points, 100, 130, 256, 16, 1), near.middleRows(100, 30));
}

TEST(GeodesicNeighbors, FewerTargetsThanAskedForAreRepeated) {
  const SurfaceSamples samples = ResampleSurface(testing::Icosphere(3), {64, 12});
  const NeighborTable near = Neighbors(samples, 3, 5);
  for (int64_t s = 0; s < 64; ++s) {
    EXPECT_EQ(std::set<int32_t>(near.row(s).begin(), near.row(s).end()), (std::set<int32_t>{0, 1, 2}));
  }
}

}  // namespace
}  // namespace stance
