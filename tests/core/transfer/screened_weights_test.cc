#include "core/transfer/screened_weights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <vector>

#include "core/base/stopwatch.h"
#include "core/mesh/nearest_rows.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

// Weights of joints 0 and 1 that go over from one to the other around y = 0, at the samples.
RowMatrix Ramp(const Points& points, float width = 0.2f) {
  RowMatrix weights = RowMatrix::Zero(points.rows(), 24);
  for (int64_t s = 0; s < points.rows(); ++s) {
    const float up = std::clamp(0.5f + points(s, 1) / width, 0.0f, 1.0f);
    weights(s, 1) = up;
    weights(s, 0) = 1 - up;
  }
  return weights;
}

RowMatrix Screened(const TriangleMesh& mesh, const SurfaceSamples& samples, const RowMatrix& sample_weights) {
  const auto weights = ScreenedWeights(mesh, samples, sample_weights);
  EXPECT_TRUE(weights.ok()) << weights.status();
  return weights.ok() ? *weights : RowMatrix();
}

// A body with twenty buttons, each far smaller than the samples are apart.
TriangleMesh Buttoned() {
  std::vector<TriangleMesh> parts = {testing::Capsule()};
  for (int i = 0; i < 20; ++i) {
    const float angle = 0.3f * static_cast<float>(i);
    parts.push_back(testing::Shifted(
        testing::Icosphere(0, 0.003f),
        {0.255f * std::cos(angle), 0.04f * static_cast<float>(i - 10), 0.255f * std::sin(angle)}));
  }
  return testing::Together(parts);
}

TEST(ScreenedWeights, AreNonNegativeAndSumToOneOnAnyMesh) {
  TriangleMesh lost = testing::Icosphere(2);
  lost.positions.conservativeResize(lost.vertex_count() + 1, 3);
  lost.positions.bottomRows(1) << 3, 3, 3;
  for (const TriangleMesh& mesh : {testing::Capsule(), testing::Fan(3), testing::Fan(4),
                                   testing::WithDegenerateFaces(), testing::TwoSpheres(), testing::Grid(9, 9),
                                   testing::Box(), lost, Buttoned(), testing::Unwelded(testing::Capsule())}) {
    const SurfaceSamples samples = ResampleSurface(mesh, {128, 12});
    const RowMatrix weights = Screened(mesh, samples, Ramp(samples.points));
    ASSERT_EQ(weights.rows(), mesh.vertex_count());
    EXPECT_GE(weights.minCoeff(), 0);
    EXPECT_LT((weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
  }
}

TEST(ScreenedWeights, ConstantsStayConstant) {
  const TriangleMesh mesh = testing::Capsule();
  const SurfaceSamples samples = ResampleSurface(mesh, {128, 12});
  RowMatrix constant = RowMatrix::Zero(128, 24);
  constant.col(3).setConstant(0.25f);
  constant.col(7).setConstant(0.75f);
  const RowMatrix weights = Screened(mesh, samples, constant);
  EXPECT_LT((weights.col(3).array() - 0.25f).abs().maxCoeff(), 1e-5f);
  EXPECT_LT((weights.col(7).array() - 0.75f).abs().maxCoeff(), 1e-5f);
}

// The same surface meshed three times as finely gets the same weights.
TEST(ScreenedWeights, DoNotDependOnTheVertexDensity) {
  const TriangleMesh fine = testing::Icosphere(5), coarse = testing::Icosphere(4);
  const auto at = [](const TriangleMesh& mesh) {
    const SurfaceSamples samples = ResampleSurface(mesh, {256, 12});
    return Screened(mesh, samples, Ramp(samples.points, 0.6f));
  };
  const RowMatrix of_fine = at(fine), of_coarse = at(coarse);
  // The first vertices of the finer sphere are those of the coarser.
  // Two sets of samples are not the same: near the ramp's ends, single vertices differ more than the rest.
  const RowMatrix difference = (of_fine.topRows(coarse.vertex_count()) - of_coarse).cwiseAbs();
  EXPECT_LT(difference.maxCoeff(), 0.15f);
  EXPECT_LT(difference.leftCols(2).mean(), 0.02f);
}

TEST(ScreenedWeights, FollowASmoothField) {
  const TriangleMesh mesh = testing::Icosphere(5);
  const SurfaceSamples samples = ResampleSurface(mesh, {1024, 12});
  const RowMatrix weights = Screened(mesh, samples, Ramp(samples.points, 1.0f));
  EXPECT_LT((weights - Ramp(mesh.positions, 1.0f)).cwiseAbs().maxCoeff(), 0.1f);
  EXPECT_LT((weights - Ramp(mesh.positions, 1.0f)).cwiseAbs().mean(), 0.002f);
}

// A hand that lies on a thigh must not stick to it: two plates, 1 cm apart, bound to one joint each.
TEST(ScreenedWeights, DoNotBleedAcrossAGap) {
  const TriangleMesh plates = testing::TwoPlates(20, 0.01f);
  const int64_t half = plates.vertex_count() / 2;
  const SurfaceSamples samples = ResampleSurface(plates, {300, 12});
  RowMatrix rigid = RowMatrix::Zero(300, 24);
  for (int64_t s = 0; s < 300; ++s) rigid(s, samples.points(s, 2) > 0.005f ? 1 : 0) = 1;
  const RowMatrix weights = Screened(plates, samples, rigid);
  EXPECT_LT((weights.col(0).head(half).array() - 1).abs().maxCoeff(), 1e-5f);
  EXPECT_LT((weights.col(1).tail(half).array() - 1).abs().maxCoeff(), 1e-5f);
}

// A part without a sample of its own bends with what it lies on, all along.
TEST(ScreenedWeights, AStrapWithoutASampleFollowsTheSurfaceUnderIt) {
  const TriangleMesh plate = testing::Shifted(testing::Grid(20, 20), {0, -0.5f, 0});
  TriangleMesh strap = testing::Grid(1, 50);
  strap.positions.col(0) *= 0.004f;
  strap = testing::Shifted(strap, {0.31f, -0.5f, 0.002f});
  SurfaceSamples samples = ResampleSurface(plate, {300, 12});
  for (const int32_t nearest : NearestRow(strap.positions, plate.positions)) {
    samples.unreached.push_back(static_cast<int32_t>(samples.cell.size()));
    samples.cell.push_back(samples.cell[nearest]);
  }
  const TriangleMesh mesh = testing::Together({plate, strap});
  const RowMatrix weights = Screened(mesh, samples, Ramp(samples.points, 1.0f));
  const RowMatrix off = (weights - Ramp(mesh.positions, 1.0f)).bottomRows(strap.vertex_count());
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 0.08f);
}

// Nails of a hand that lies on a thigh: half a millimetre from the one, three from the other.
TEST(ScreenedWeights, CrumbsBelongToTheSurfaceNextToThem) {
  constexpr float kGap = 0.0035f;
  std::vector<TriangleMesh> parts = {testing::TwoPlates(20, kGap)};
  const int64_t plates = parts[0].vertex_count();
  for (int i = 0; i < 20; ++i) {
    parts.push_back(testing::Shifted(testing::Icosphere(0, 0.0001f),
                                     {0.047f * static_cast<float>(i + 1), 0.5f, 0.0005f}));
  }
  const TriangleMesh mesh = testing::Together(parts);
  const SurfaceSamples samples = ResampleSurface(mesh, {300, 12});
  RowMatrix rigid = RowMatrix::Zero(300, 24);
  for (int64_t s = 0; s < 300; ++s) rigid(s, samples.points(s, 2) > kGap / 2 ? 1 : 0) = 1;
  const RowMatrix weights = Screened(mesh, samples, rigid);
  EXPECT_GT(std::ssize(samples.unreached), 120);
  EXPECT_GT(weights.col(0).tail(mesh.vertex_count() - plates).minCoeff(), 0.95f);
}

// A limit of the service: a scan of a million vertices.
TEST(ScreenedWeights, DISABLED_AMillionVertices) {
  const TriangleMesh mesh = testing::Grid(999, 999);
  Stopwatch watch;
  const SurfaceSamples samples = ResampleSurface(mesh, {1024, 12});
  const double resampling = watch.Lap();
  const RowMatrix weights = Screened(mesh, samples, Ramp(samples.points, 2.0f));
  const double solving = watch.Lap();
  std::cout << "resample " << resampling << " s, weights " << solving << " s\n";
  EXPECT_GE(weights.minCoeff(), 0);
  EXPECT_LT((weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
}

TEST(ScreenedSmoother, TakesTheRigsSamples) {
  const TriangleMesh mesh = testing::Capsule();
  SurfaceSamples samples = ResampleSurface(mesh, {128, 12});
  const RowMatrix ramp = Ramp(samples.points), expected = Screened(mesh, samples, ramp);
  Rig rig;
  rig.sampled = std::make_shared<const SampledWeights>(SampledWeights{std::move(samples), ramp});
  const auto weights = ScreenedSmoother().Smooth(mesh, rig);
  ASSERT_TRUE(weights.ok()) << weights.status();
  EXPECT_EQ(*weights, expected);
}

}  // namespace
}  // namespace stance
