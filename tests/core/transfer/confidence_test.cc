#include "core/transfer/confidence.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

// Rows that sum to 1.
RowMatrix RandomWeights(int64_t vertices, uint64_t seed) {
  Random random(seed);
  RowMatrix weights(vertices, kHumanJoints);
  for (int64_t i = 0; i < weights.size(); ++i) weights.data()[i] = static_cast<float>(random.Uniform(0, 1));
  return weights.array().colwise() / weights.rowwise().sum().array();
}

Eigen::VectorXf RandomConfidence(uint64_t seed) {
  Random random(seed);
  Eigen::VectorXf confidence(kHumanJoints);
  for (float& value : confidence) value = static_cast<float>(random.Uniform(0, 1));
  return confidence;
}

TEST(CalibratedConfidence, TheDefaultChangesNothing) {
  for (const double p : {0.0, 1e-9, 0.3, 0.5, 1.0}) EXPECT_EQ(CalibratedConfidence(p, {}), p);
}

TEST(CalibratedConfidence, IsAffineInTheLogit) {
  const ConfidenceCalibration calibration{.scale = 0.7, .bias = -0.4};
  for (const double p : {0.01, 0.3, 0.5, 0.95}) {
    EXPECT_NEAR(Logit(CalibratedConfidence(p, calibration)), 0.7 * Logit(p) - 0.4, 1e-9);
  }
}

TEST(CalibratedConfidence, KeepsTheOrderAndStaysAProbability) {
  for (const ConfidenceCalibration& calibration :
       {ConfidenceCalibration{0.1, 3}, {5, -2}, {1e300, 1e300}, {1e-300, -1e300}}) {
    double last = 0;
    for (int i = 0; i <= 100; ++i) {
      const double p = CalibratedConfidence(i / 100.0, calibration);
      EXPECT_GE(p, last);
      EXPECT_LE(p, 1);
      last = p;
    }
  }
}

TEST(JointShares, SumToOne) {
  const TriangleMesh mesh = testing::Capsule();
  const Eigen::VectorXf shares =
      JointShares(mesh.positions, mesh.faces, RandomWeights(mesh.vertex_count(), 1));
  EXPECT_NEAR(shares.sum(), 1, 1e-5f);
  EXPECT_GE(shares.minCoeff(), 0);
}

// Whatever the density of the vertices.
TEST(JointShares, CountTheSurfaceNotTheVertices) {
  const TriangleMesh grid = testing::Grid(8, 8);
  RowMatrix weights = RowMatrix::Zero(grid.vertex_count(), kHumanJoints);
  TriangleMesh squeezed = grid;  // three quarters of the columns in a tenth of the width
  for (int64_t v = 0; v < grid.vertex_count(); ++v) {
    const float x = grid.positions(v, 0);
    squeezed.positions(v, 0) = x <= 0.75f ? x * 0.1f / 0.75f : 0.1f + (x - 0.75f) * 0.9f / 0.25f;
    weights(v, x < 0.8f ? 3 : 7) = 1;
  }
  const Eigen::VectorXf shares = JointShares(squeezed.positions, squeezed.faces, weights);
  EXPECT_LT(shares[3], 0.4f);
  EXPECT_NEAR(shares[3] + shares[7], 1, 1e-5f);
}

TEST(JointShares, AMeshWithoutAreaCountsItsVertices) {
  Points line(4, 3);
  line << 0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0;
  Faces faces(1, 3);
  faces << 0, 1, 2;
  RowMatrix weights = RowMatrix::Zero(4, 2);
  weights.col(0).setConstant(0.25f);
  weights.col(1).setConstant(0.75f);
  EXPECT_LT((JointShares(line, faces, weights) - Eigen::Vector2f(0.25f, 0.75f)).norm(), 1e-5f);
}

TEST(TransferConfidence, IsAProbability) {
  const TriangleMesh mesh = testing::Capsule();
  for (uint64_t seed = 1; seed < 10; ++seed) {
    const Eigen::VectorXf shares =
        JointShares(mesh.positions, mesh.faces, RandomWeights(mesh.vertex_count(), seed));
    const auto confidence = TransferConfidence(shares, RandomConfidence(seed), RandomConfidence(seed + 100));
    ASSERT_TRUE(confidence.has_value());
    EXPECT_GE(*confidence, 0);
    EXPECT_LE(*confidence, 1);
  }
  const Eigen::VectorXf shares = Eigen::VectorXf::Constant(kHumanJoints, 1.0f / kHumanJoints);
  const Eigen::VectorXf sure = Eigen::VectorXf::Ones(kHumanJoints);
  EXPECT_NEAR(*TransferConfidence(shares, sure, sure), 1, 1e-5f);
  EXPECT_EQ(*TransferConfidence(shares, sure, 0 * sure), 0);
}

TEST(TransferConfidence, GrowsWithEachJointsAndSourceAndReferenceCountAlike) {
  const TriangleMesh mesh = testing::Capsule();
  const Eigen::VectorXf shares =
      JointShares(mesh.positions, mesh.faces, RandomWeights(mesh.vertex_count(), 3));
  const Eigen::VectorXf source = RandomConfidence(4), reference = RandomConfidence(5);
  const float base = *TransferConfidence(shares, source, reference);
  EXPECT_NEAR(*TransferConfidence(shares, reference, source), base, 1e-6f);
  for (int j = 0; j < kHumanJoints; ++j) {
    Eigen::VectorXf surer = source;
    surer[j] = 1;
    EXPECT_GE(*TransferConfidence(shares, surer, reference), base);
  }
}

// A joint that moves nothing does not matter.
TEST(TransferConfidence, AJointCountsByWhatItMoves) {
  Eigen::VectorXf shares = Eigen::VectorXf::Zero(kHumanJoints), sure = Eigen::VectorXf::Ones(kHumanJoints);
  shares[2] = 0.75f;
  shares[5] = 0.25f;
  Eigen::VectorXf source = sure;
  source[5] = 0;
  source[9] = 0;
  EXPECT_NEAR(*TransferConfidence(shares, source, sure), 0.75f, 1e-6f);
}

TEST(TransferConfidence, IsUnknownWhereARigDoesNotKnowItsOwn) {
  const Eigen::VectorXf some = Eigen::VectorXf::Constant(kHumanJoints, 0.5f);
  EXPECT_FALSE(TransferConfidence(some, {}, some).has_value());
  EXPECT_FALSE(TransferConfidence(some, some, {}).has_value());
}

}  // namespace
}  // namespace stance
