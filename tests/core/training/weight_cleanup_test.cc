#include "core/training/weight_cleanup.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/skeleton/skeleton.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

// Random positive weights of random sums on four joints, two of them mirror images.
RowMatrix RawWeights(Eigen::Index rows) {
  Random random(1);
  RowMatrix weights = RowMatrix::Zero(rows, kHumanJoints);
  for (Eigen::Index v = 0; v < rows; ++v) {
    for (const int j : {kPelvis, kLeftHip, kRightHip, kSpine1})
      weights(v, j) = static_cast<float>(random.Uniform(0.05, 0.4));
  }
  return weights;
}

TEST(CleanWeights, RowsSumToOneWithoutSpecks) {
  const TriangleMesh mesh = testing::Icosphere(3);
  const RowMatrix weights = CleanWeights(RawWeights(mesh.vertex_count()), mesh.positions, mesh.faces);
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    EXPECT_NEAR(weights.row(v).sum(), 1, 1e-5);
    for (int j = 0; j < kHumanJoints; ++j) EXPECT_TRUE(weights(v, j) == 0 || weights(v, j) >= 0.005f);
  }
}

TEST(CleanWeights, MirrorImagesHaveMirroredWeights) {
  const TriangleMesh mesh = testing::Icosphere(2);  // symmetric in x
  const RowMatrix weights = CleanWeights(RawWeights(mesh.vertex_count()), mesh.positions, mesh.faces);
  int pairs = 0;
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    for (Eigen::Index u = 0; u < mesh.vertex_count(); ++u) {
      const Eigen::RowVector3f image = mesh.positions.row(u).array() * Eigen::RowVector3f(-1, 1, 1).array();
      if ((image - mesh.positions.row(v)).norm() > 1e-4f) continue;
      ++pairs;
      for (int j = 0; j < kHumanJoints; ++j) EXPECT_NEAR(weights(v, j), weights(u, MirrorJoint(j)), 1e-5);
    }
  }
  EXPECT_EQ(pairs, mesh.vertex_count());
}

TEST(CleanWeights, ConstantWeightsStay) {
  const TriangleMesh mesh = testing::Icosphere(2);
  RowMatrix raw = RowMatrix::Zero(mesh.vertex_count(), kHumanJoints);
  raw.col(kSpine1).setConstant(0.3f);
  raw.col(kSpine2).setConstant(0.1f);
  const RowMatrix weights = CleanWeights(raw, mesh.positions, mesh.faces);
  EXPECT_LT((weights.col(kSpine1).array() - 0.75f).abs().maxCoeff(), 1e-5f);
  EXPECT_LT((weights.col(kSpine2).array() - 0.25f).abs().maxCoeff(), 1e-5f);
}

TEST(CleanWeights, AStepBecomesARamp) {
  const TriangleMesh mesh = testing::Icosphere(3);
  RowMatrix raw = RowMatrix::Zero(mesh.vertex_count(), kHumanJoints);
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v)
    raw(v, mesh.positions(v, 1) > 0 ? kSpine1 : kPelvis) = 1;
  const auto largest_jump = [&mesh](const RowMatrix& weights) {
    float jump = 0;
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      jump = std::max(jump,
                      (weights.row(mesh.faces(f, 0)) - weights.row(mesh.faces(f, 1))).cwiseAbs().maxCoeff());
    }
    return jump;
  };
  EXPECT_FLOAT_EQ(largest_jump(raw), 1);
  EXPECT_LT(largest_jump(CleanWeights(raw, mesh.positions, mesh.faces)), 0.6f);
}

TEST(CleanWeights, AVertexWithoutWeightTakesItsNeighbours) {
  const TriangleMesh mesh = testing::Icosphere(2);
  RowMatrix raw = RowMatrix::Zero(mesh.vertex_count(), kHumanJoints);
  raw.col(kHead).setOnes();
  raw(17, kHead) = 0;
  EXPECT_NEAR(CleanWeights(raw, mesh.positions, mesh.faces)(17, kHead), 1, 1e-5);
}

}  // namespace
}  // namespace stance
