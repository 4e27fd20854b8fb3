#include "core/transfer/screened_weights.h"

#include <gtest/gtest.h>

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

TEST(ScreenedWeights, AreNonNegativeAndSumToOneOnAnyMesh) {
  TriangleMesh lost = testing::Icosphere(2);
  lost.positions.conservativeResize(lost.vertex_count() + 1, 3);
  lost.positions.bottomRows(1) << 3, 3, 3;
  for (const TriangleMesh& mesh : {testing::Capsule(), testing::Fan(4), testing::WithDegenerateFaces(),
                                   testing::TwoSpheres(), testing::Grid(9, 9), testing::Box(), lost}) {
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
