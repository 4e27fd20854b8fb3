#include "core/training/holes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "core/mesh/measure.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

std::set<std::array<int32_t, 3>> FaceSet(const Faces& faces) {
  std::set<std::array<int32_t, 3>> set;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) set.insert({faces(f, 0), faces(f, 1), faces(f, 2)});
  return set;
}

TEST(CutHoles, NoBallCutsNothing) {
  const TriangleMesh mesh = testing::Grid(20, 20);
  Random random(1);
  EXPECT_EQ(CutHoles(random, 0, mesh.positions, mesh.faces), mesh.faces);
}

TEST(CutHoles, NeverCutsMoreThanAskedFor) {
  const TriangleMesh mesh = testing::Icosphere(4, 0.3f);
  const std::set<std::array<int32_t, 3>> all = FaceSet(mesh.faces);
  const double area = SurfaceArea(mesh.positions, mesh.faces);
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    const Faces kept = CutHoles(random, 8, mesh.positions, mesh.faces);
    EXPECT_LT(kept.rows(), mesh.faces.rows());
    EXPECT_GE(SurfaceArea(mesh.positions, kept), 0.7 * area);
    const auto left = FaceSet(kept);
    EXPECT_EQ(left.size(), static_cast<size_t>(kept.rows()));
    EXPECT_TRUE(std::includes(all.begin(), all.end(), left.begin(), left.end()));
  }
}

TEST(CutHoles, AHoleIsABall) {
  const TriangleMesh mesh = testing::Grid(60, 60);
  for (uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    const auto kept = FaceSet(CutHoles(random, 1, mesh.positions, mesh.faces));
    Points cut(0, 3);
    for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
      if (kept.contains({mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2)})) continue;
      cut.conservativeResize(cut.rows() + 1, 3);
      cut.bottomRows(1) = mesh.positions.row(mesh.faces(f, 0));
    }
    ASSERT_GT(cut.rows(), 0);
    // 15 cm about the centre, and an edge of 1/60 about the centroids.
    EXPECT_LT((cut.colwise().maxCoeff() - cut.colwise().minCoeff()).maxCoeff(), 0.3f + 2.0f / 60);
  }
}

TEST(CutHoles, ABallAsLargeAsTheMeshCutsNothing) {
  const TriangleMesh mesh = testing::Icosphere(2, 0.01f);
  Random random(3);
  EXPECT_EQ(CutHoles(random, 5, mesh.positions, mesh.faces), mesh.faces);
}

TEST(CutHoles, TheSameSeedCutsTheSameHoles) {
  const TriangleMesh mesh = testing::Grid(40, 40);
  Random first(4), second(4), other(5);
  const Faces faces = CutHoles(first, 2, mesh.positions, mesh.faces);
  EXPECT_EQ(faces, CutHoles(second, 2, mesh.positions, mesh.faces));
  EXPECT_NE(FaceSet(faces), FaceSet(CutHoles(other, 2, mesh.positions, mesh.faces)));
}

TEST(CutShare, TheAreaIsWhatWasAskedForToAFace) {
  const TriangleMesh mesh = testing::Icosphere(4, 0.3f);
  const double area = SurfaceArea(mesh.positions, mesh.faces);
  const double face = 2 * area / static_cast<double>(mesh.face_count());  // none is larger
  for (const double share : {0.05, 0.1, 0.2, 0.3, 0.9}) {
    Random random(1);
    const Faces kept = CutShare(random, share, mesh.positions, mesh.faces);
    const double cut = area - SurfaceArea(mesh.positions, kept);
    EXPECT_GE(cut, share * area * (1 - 1e-6));
    EXPECT_LE(cut, share * area + face);
  }
}

TEST(CutShare, NothingOfAMeshIsNothing) {
  const TriangleMesh mesh = testing::Grid(20, 20);
  Random random(1);
  EXPECT_EQ(CutShare(random, 0, mesh.positions, mesh.faces), mesh.faces);
}

TEST(CutShare, AGreaterShareOfTheSameSeedHasTheSmallerOnesHoles) {
  const TriangleMesh mesh = testing::Grid(40, 40);
  std::set<std::array<int32_t, 3>> before = FaceSet(mesh.faces);
  for (const double share : {0.05, 0.1, 0.3}) {
    Random random(7);
    const auto kept = FaceSet(CutShare(random, share, mesh.positions, mesh.faces));
    EXPECT_LT(kept.size(), before.size());
    EXPECT_TRUE(std::includes(before.begin(), before.end(), kept.begin(), kept.end()));
    before = kept;
  }
}

// Of two unit squares the one with eight times shorter edges loses no more than the other, on average.
TEST(CutShare, TheMeshingDoesNotDrawHoles) {
  const TriangleMesh coarse = testing::Grid(10, 20), fine = testing::Grid(80, 160);
  Points positions(coarse.vertex_count() + fine.vertex_count(), 3);
  positions << coarse.positions, fine.positions;
  positions.bottomRows(fine.vertex_count()).col(0).array() += 1;
  Faces faces(coarse.face_count() + fine.face_count(), 3);
  faces << coarse.faces, fine.faces.array() + static_cast<int32_t>(coarse.vertex_count());
  double fine_cut = 0;
  for (uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    const Faces kept = CutShare(random, 0.1, positions, faces);
    const double left_of_coarse = SurfaceArea(
        positions, kept.topRows((kept.col(0).array() < static_cast<int32_t>(coarse.vertex_count())).count()));
    fine_cut += (1 - (SurfaceArea(positions, kept) - left_of_coarse)) / 50;
  }
  EXPECT_NEAR(fine_cut, 0.1, 0.03);  // of the 0.2 in all
}

// Its faces' centroids lie farther from their corners than any ball reaches.
TEST(CutShare, CutsFacesThatAreLargerThanABall) {
  const TriangleMesh mesh = testing::Box(2, 2, 2);
  Random random(2);
  EXPECT_EQ(CutShare(random, 0.25, mesh.positions, mesh.faces).rows(), 9);
}

}  // namespace
}  // namespace stance
