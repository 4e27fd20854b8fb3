#include "core/transfer/diffusion_smoother.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "core/base/random.h"
#include "core/mesh/laplacian.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

// Joint 0 below, joint 1 above y = 0.
RowMatrix HalfAndHalf(const TriangleMesh& mesh) {
  RowMatrix w = RowMatrix::Zero(mesh.vertex_count(), 24);
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) w(v, mesh.positions(v, 1) > 0 ? 1 : 0) = 1;
  return w;
}

RowMatrix RandomRigid(const TriangleMesh& mesh) {
  Random random(1);
  RowMatrix w = RowMatrix::Zero(mesh.vertex_count(), 24);
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) w(v, random.Below(24)) = 1;
  return w;
}

Rig RigOf(RowMatrix weights) {
  Rig rig;
  rig.weights = std::move(weights);
  return rig;
}

SmoothingOptions Options(SmoothingKind kind) {
  SmoothingOptions options;
  options.kind = kind;
  return options;
}

class EveryKind : public ::testing::TestWithParam<SmoothingKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind,
                         ::testing::Values(SmoothingKind::kMetric, SmoothingKind::kHopwise,
                                           SmoothingKind::kNone));

TEST_P(EveryKind, WeightsStayNonNegativeAndSumToOneOnAnyMesh) {
  TriangleMesh lost = testing::Icosphere(2);
  lost.positions.conservativeResize(lost.vertex_count() + 1, 3);
  lost.positions.bottomRows(1) << 3, 3, 3;
  for (const TriangleMesh& mesh : {testing::Capsule(), testing::Fan(4), testing::WithDegenerateFaces(),
                                   testing::TwoSpheres(), testing::Grid(9, 9), lost}) {
    const auto smooth = MakeSmoother(Options(GetParam()))->Smooth(mesh, RigOf(RandomRigid(mesh)));
    ASSERT_TRUE(smooth.ok()) << smooth.status();
    EXPECT_GE(smooth->minCoeff(), 0);
    EXPECT_LT((smooth->rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
  }
}

TEST_P(EveryKind, ConstantWeightsStayConstant) {
  const TriangleMesh mesh = testing::Capsule();
  RowMatrix w = RowMatrix::Zero(mesh.vertex_count(), 24);
  w.col(3).setOnes();
  const auto smooth = MakeSmoother(Options(GetParam()))->Smooth(mesh, RigOf(w));
  ASSERT_TRUE(smooth.ok());
  EXPECT_LT((*smooth - w).cwiseAbs().maxCoeff(), 1e-5f);
}

TEST(DiffusionSmoother, DoesNotCrossBetweenComponents) {
  const TriangleMesh two = testing::TwoSpheres(2);
  RowMatrix w = RowMatrix::Zero(two.vertex_count(), 24);
  const int64_t half = two.vertex_count() / 2;
  w.block(0, 0, half, 1).setOnes();
  w.block(half, 1, half, 1).setOnes();
  const auto smooth = DiffusionSmoother({}).Smooth(two, RigOf(w));
  ASSERT_TRUE(smooth.ok());
  EXPECT_LT((*smooth - w).cwiseAbs().maxCoeff(), 1e-5f);
}

TEST(DiffusionSmoother, MetricKindDoesNotDependOnResolution) {
  SmoothingOptions options;
  options.length = 0.08;
  double widths[2];
  int i = 0;
  for (const int segments : {24, 48}) {
    const TriangleMesh mesh = testing::Capsule(1.0f, 0.15f, segments, segments / 4, segments * 2);
    const auto smooth = DiffusionSmoother(options).Smooth(mesh, RigOf(HalfAndHalf(mesh)));
    ASSERT_TRUE(smooth.ok());
    // The height at which joint 1's weight passes 3/4, interpolated over vertices on the tube.
    double below = -1, above = 1;
    for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
      const double y = mesh.positions(v, 1);
      if ((*smooth)(v, 1) < 0.75 && y > below) below = y;
      if ((*smooth)(v, 1) >= 0.75 && y < above) above = y;
    }
    widths[i++] = 0.5 * (below + above);
  }
  EXPECT_GT(widths[0], 0.01);
  EXPECT_NEAR(widths[0], widths[1], 0.25 * widths[0]);
}

TEST(DiffusionSmoother, HopwiseKindIsThePapersOperator) {
  // (I - lambda L)^-1 W with L = -D^-1 L_c, by a dense inverse.
  const TriangleMesh mesh = testing::Capsule(1.0f, 0.25f, 8, 2, 4);
  const RowMatrix w = RandomRigid(mesh);
  const auto smooth = DiffusionSmoother(Options(SmoothingKind::kHopwise)).Smooth(mesh, RigOf(w));
  ASSERT_TRUE(smooth.ok());
  const Eigen::MatrixXd l_c = CotangentLaplacian(mesh.positions, mesh.faces);
  const Eigen::MatrixXd d_inverse = l_c.diagonal().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd system = Eigen::MatrixXd::Identity(l_c.rows(), l_c.cols()) + 20.0 * d_inverse * l_c;
  const Eigen::MatrixXd expected = system.inverse() * w.cast<double>();
  EXPECT_LT((smooth->cast<double>() - expected).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(LimitInfluences, KeepsTheLargestAndRescales) {
  RowMatrix w(2, 5);
  w << 0.4f, 0.3f, 0.15f, 0.1f, 0.05f, 0.2f, 0.2f, 0.2f, 0.2f, 0.2f;
  LimitInfluences(w, 2);
  EXPECT_NEAR(w(0, 0), 4.0 / 7, 1e-6);
  EXPECT_NEAR(w(0, 1), 3.0 / 7, 1e-6);
  for (int row = 0; row < 2; ++row) {
    EXPECT_EQ((w.row(row).array() > 0).count(), 2);
    EXPECT_NEAR(w.row(row).sum(), 1, 1e-6);
  }
}

TEST(LimitInfluences, OfZeroKeepsAll) {
  RowMatrix w(1, 3);
  w << 0.2f, 0.3f, 0.5f;
  const RowMatrix before = w;
  LimitInfluences(w, 0);
  EXPECT_EQ(w, before);
}

}  // namespace
}  // namespace stance
