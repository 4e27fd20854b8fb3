#include "core/mesh/resample.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "tests/support/meshes.h"

namespace stance {
namespace {

TEST(ResampleSurface, GivesTheCountAskedForWhateverTheResolution) {
  for (const TriangleMesh& mesh : {testing::Box(1, 2, 0.5f), testing::Icosphere(2), testing::Icosphere(6)}) {
    const SurfaceSamples samples = ResampleSurface(mesh, {500, 12});
    EXPECT_EQ(samples.points.rows(), 500);
    EXPECT_EQ(samples.one_ring.rows(), 500);
    EXPECT_EQ(static_cast<int64_t>(samples.cell.size()), mesh.vertex_count());
  }
}

TEST(ResampleSurface, SamplesLieOnTheSurface) {
  const SurfaceSamples samples = ResampleSurface(testing::Box(1, 1, 1), {300, 12});
  for (int64_t s = 0; s < samples.points.rows(); ++s) {
    const auto p = samples.points.row(s).array();
    const float to_side = std::min(p.abs().minCoeff(), (1 - p).abs().minCoeff());
    EXPECT_LT(to_side, 1e-5f);
    EXPECT_GE(p.minCoeff(), -1e-5f);
    EXPECT_LE(p.maxCoeff(), 1 + 1e-5f);
  }
}

TEST(ResampleSurface, SpacingIsEvenOnMeshesOfUnevenDensity) {
  // A sphere whose upper half is 16 times denser: samples per area must not follow the vertices.
  const TriangleMesh fine = testing::Icosphere(5), coarse = testing::Icosphere(3);
  TriangleMesh mixed;
  mixed.positions.resize(fine.vertex_count() + coarse.vertex_count(), 3);
  mixed.positions << fine.positions, coarse.positions;
  std::vector<Eigen::RowVector3i> faces;
  for (int64_t f = 0; f < fine.face_count(); ++f) {
    if (fine.positions(fine.faces(f, 0), 1) > 0) faces.emplace_back(fine.faces.row(f));
  }
  for (int64_t f = 0; f < coarse.face_count(); ++f) {
    if (coarse.positions(coarse.faces(f, 0), 1) <= 0) {
      faces.emplace_back(coarse.faces.row(f).array() + static_cast<int32_t>(fine.vertex_count()));
    }
  }
  mixed.faces.resize(static_cast<int64_t>(faces.size()), 3);
  for (size_t f = 0; f < faces.size(); ++f) mixed.faces.row(static_cast<int64_t>(f)) = faces[f];
  const SurfaceSamples samples = ResampleSurface(mixed, {600, 12});
  const auto above = (samples.points.col(1).array() > 0).count();
  EXPECT_NEAR(static_cast<double>(above), 300, 45);
}

TEST(ResampleSurface, MovesWithTheMesh) {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.3f);
  mesh.positions.col(0) +=
      0.1f * mesh.positions.col(1).cwiseProduct(mesh.positions.col(2));  // no symmetry, no ties
  mesh.positions.col(2) += 0.07f * mesh.positions.col(0).cwiseProduct(mesh.positions.col(1)) +
                           0.05f * mesh.positions.col(0).cwiseAbs2();
  const SurfaceSamples before = ResampleSurface(mesh, {200, 12});
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(1.1f, Eigen::Vector3f(1, -2, 0.5f).normalized()).toRotationMatrix();
  TriangleMesh moved = mesh;
  moved.positions = (mesh.positions * turn.transpose()).rowwise() + Eigen::RowVector3f(0.3f, 0.1f, -0.2f);
  const SurfaceSamples after = ResampleSurface(moved, {200, 12});
  const Points expected =
      (before.points * turn.transpose()).rowwise() + Eigen::RowVector3f(0.3f, 0.1f, -0.2f);
  // Rounding may swap two samples of nearly equal distance, so compare as sets.
  int off = 0;
  for (int64_t s = 0; s < expected.rows(); ++s) {
    off += (after.points.rowwise() - expected.row(s)).rowwise().norm().minCoeff() > 1e-4f;
  }
  EXPECT_LE(off, 4);
}

TEST(ResampleSurface, OneRingIsSymmetricAndPaddedWithTheSample) {
  const SurfaceSamples samples = ResampleSurface(testing::Icosphere(4), {200, 16});
  double total = 0;
  for (int32_t s = 0; s < 200; ++s) {
    std::vector<int32_t> ring;
    for (int i = 0; i < 16; ++i) {
      const int32_t n = samples.one_ring(s, i);
      ASSERT_GE(n, 0);
      ASSERT_LT(n, 200);
      if (n == s) continue;
      ring.push_back(n);
      bool back = false;
      for (int j = 0; j < 16; ++j) back |= samples.one_ring(n, j) == s;
      EXPECT_TRUE(back) << s << " " << n;
    }
    total += static_cast<double>(ring.size());
  }
  // Euler: the dual of a Voronoi diagram on a sphere has 3 (N - 2) edges, if no four cells meet.
  EXPECT_NEAR(total / 200, 6 - 12.0 / 200, 0.4);
}

TEST(ResampleSurface, NearbySheetsAreNoNeighbours) {
  // Two parallel plates 1 cm apart: the one-ring and the cells stay on their own plate.
  const TriangleMesh plates = testing::TwoPlates(20, 0.01f);
  const SurfaceSamples samples = ResampleSurface(plates, {200, 12});
  for (int64_t s = 0; s < samples.points.rows(); ++s) {
    for (int i = 0; i < 12; ++i) EXPECT_EQ(samples.points(samples.one_ring(s, i), 2), samples.points(s, 2));
  }
  for (int64_t v = 0; v < plates.vertex_count(); ++v) {
    EXPECT_EQ(samples.points(samples.cell[v], 2), plates.positions(v, 2));
  }
}

TEST(ResampleSurface, EveryVertexHasACellOnUglyMeshes) {
  TriangleMesh lost = testing::Icosphere(3);
  lost.positions.conservativeResize(lost.vertex_count() + 1, 3);
  lost.positions.bottomRows(1) << 3, 3, 3;  // unreferenced
  for (const TriangleMesh& mesh : {testing::Fan(3), testing::WithDegenerateFaces(), testing::TwoSpheres(3),
                                   lost, testing::Unwelded(testing::Icosphere(1))}) {
    const SurfaceSamples samples = ResampleSurface(mesh, {128, 12});
    for (const int32_t cell : samples.cell) {
      ASSERT_GE(cell, 0);
      ASSERT_LT(cell, samples.points.rows());
    }
    EXPECT_TRUE(samples.points.allFinite());
  }
}

TEST(ResampleSurface, SurvivesANeedle) {
  TriangleMesh needle;
  needle.positions.resize(3, 3);
  needle.positions << 0, 0, 0, 1000, 0, 0, 0, 1e-6f, 0;
  needle.faces.resize(1, 3);
  needle.faces << 0, 1, 2;
  const SurfaceSamples samples = ResampleSurface(needle, {128, 12});
  EXPECT_GE(samples.points.rows(), 3);
  EXPECT_TRUE(samples.points.allFinite());
}

TEST(VertexSamples, AreTheVerticesWithTheirOneRing) {
  const TriangleMesh sphere = testing::Icosphere(2);
  const SurfaceSamples samples = VertexSamples(sphere, 8);
  EXPECT_EQ(samples.points, sphere.positions);
  int twelve = 0;
  for (int64_t v = 0; v < sphere.vertex_count(); ++v) {
    int degree = 0;
    for (int i = 0; i < 8; ++i) degree += samples.one_ring(v, i) != v;
    EXPECT_TRUE(degree == 5 || degree == 6);
    twelve += degree == 5;
    EXPECT_EQ(samples.cell[v], v);
  }
  EXPECT_EQ(twelve, 12);  // the icosahedron's own corners
}

TEST(VertexSamples, LeaveOutVerticesWithoutAFace) {
  const TriangleMesh sphere = testing::Icosphere(2);
  TriangleMesh mesh = sphere;
  mesh.positions.conservativeResize(sphere.vertex_count() + 1, 3);
  mesh.positions.bottomRows(1) << 3, 3, 3;
  const SurfaceSamples samples = VertexSamples(mesh, 8);
  EXPECT_EQ(samples.points, sphere.positions);
  Eigen::Index nearest;
  (sphere.positions.rowwise() - mesh.positions.bottomRows(1).row(0)).rowwise().norm().minCoeff(&nearest);
  EXPECT_EQ(samples.cell.back(), nearest);
}

TEST(ResampleSurface, IgnoresVerticesWithoutAFace) {
  const TriangleMesh sphere = testing::Icosphere(4);
  TriangleMesh mesh = sphere;
  mesh.positions.conservativeResize(sphere.vertex_count() + 1, 3);
  mesh.positions.bottomRows(1) << 300, 300, 300;
  EXPECT_EQ(ResampleSurface(mesh, {256, 12}).points, ResampleSurface(sphere, {256, 12}).points);
}

TEST(ResampleSurface, PlacesSayWhereTheSamplesLie) {
  for (const TriangleMesh& mesh : {testing::Box(1, 2, 3), testing::Icosphere(1), testing::Icosphere(6),
                                   testing::Fan(5), testing::WithDegenerateFaces()}) {
    const SurfaceSamples samples = ResampleSurface(mesh, {300, 12});
    ASSERT_EQ(std::ssize(samples.place), samples.points.rows());
    EXPECT_LT((ValuesAt(mesh.positions, samples.place) - samples.points).cwiseAbs().maxCoeff(), 1e-5f);
    for (const SurfacePlace& place : samples.place) {
      EXPECT_NEAR(place.weight[0] + place.weight[1] + place.weight[2], 1, 1e-6f);
      for (int i = 0; i < 3; ++i) EXPECT_GE(place.weight[i], 0);
    }
  }
}

TEST(ResampleSurfaceRepeatedly, SamplingsShareNoPlaceAndAreEven) {
  const TriangleMesh mesh = testing::Icosphere(5);
  const auto samplings = ResampleSurfaceRepeatedly(mesh, 4, {400, 12});
  ASSERT_EQ(samplings.size(), 4u);
  EXPECT_EQ(samplings[0].points, ResampleSurface(mesh, {400, 12}).points);
  std::set<std::array<float, 3>> places;
  for (const SurfaceSamples& samples : samplings) {
    ASSERT_EQ(samples.points.rows(), 400);
    for (int64_t s = 0; s < 400; ++s) {
      const auto p = samples.points.row(s);
      EXPECT_TRUE(places.insert({p[0], p[1], p[2]}).second);
      EXPECT_GE(samples.cell[samples.place[s].corner[0]], 0);
      float nearest = 10;
      for (int64_t other = 0; other < 400; ++other) {
        if (other != s) nearest = std::min(nearest, (samples.points.row(other) - p).norm());
      }
      EXPECT_GT(nearest, 0.5f * std::sqrt(4 * 3.14159f / 400));  // of the spacing of a square grid
    }
  }
}

TEST(ResampleSurfaceRepeatedly, GivesOneWhereTheSurfaceHasNoPointsForMore) {
  TriangleMesh box = testing::Box(1, 1, 1);
  ASSERT_EQ(box.vertex_count(), 8);
  EXPECT_EQ(ResampleSurfaceRepeatedly(box, 4, {1, 12}).size(), 4u);
  EXPECT_LT(ResampleSurfaceRepeatedly(box, 40, {1, 12}).size(), 40u);
  TriangleMesh point = testing::Fan(5);
  point.positions.setOnes();
  ASSERT_EQ(ResampleSurfaceRepeatedly(point, 4, {100, 12}).size(), 1u);
  EXPECT_EQ(ResampleSurfaceRepeatedly(point, 4, {100, 12})[0].points.rows(), 1);
}

TEST(JoinedSamples, HasAllSamplesAndTheFirstOnesCells) {
  const TriangleMesh mesh = testing::Icosphere(4);
  const auto samplings = ResampleSurfaceRepeatedly(mesh, 3, {100, 12});
  const SurfaceSamples joined = JoinedSamples(samplings);
  ASSERT_EQ(joined.points.rows(), 300);
  EXPECT_EQ(joined.points.middleRows(100, 100), samplings[1].points);
  EXPECT_EQ(joined.normals.bottomRows(100), samplings[2].normals);
  EXPECT_LT((ValuesAt(mesh.positions, joined.place) - joined.points).cwiseAbs().maxCoeff(), 1e-5f);
  EXPECT_EQ(joined.cell, samplings[0].cell);
}

TEST(ResampleSurface, NormalsPointOutwardsOnASphere) {
  const SurfaceSamples samples = ResampleSurface(testing::Icosphere(4), {256, 12});
  EXPECT_GT(samples.points.cwiseProduct(samples.normals).rowwise().sum().minCoeff(), 0.99f);
  EXPECT_NEAR(samples.normals.rowwise().norm().minCoeff(), 1, 1e-5f);
}

}  // namespace
}  // namespace stance
