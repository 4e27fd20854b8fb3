#include "core/mesh/metrics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace stance {
namespace {

// A unit square in the plane z = 0, cut along the diagonal 0-2.
//   3 --- 2
//   |   / |
//   | /   |
//   0 --- 1
struct Square {
  Points positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  Faces faces{{0, 1, 2}, {0, 2, 3}};
};

Points RandomPoints(int count, uint64_t seed) {
  Random random(seed);
  Points points(count, 3);
  for (int i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis) points(i, axis) = static_cast<float>(random.Uniform(-1, 1));
  }
  return points;
}

TEST(CompareMeshes, IsZeroForTheTruthItself) {
  const Square square;
  const MeshErrors errors = CompareMeshes(square.positions, square.positions, square.faces);
  EXPECT_EQ(errors.pmd, 0);
  EXPECT_EQ(errors.mean_mm, 0);
  EXPECT_EQ(errors.max_dist, 0);
  EXPECT_EQ(errors.elr, 0);
  EXPECT_EQ(errors.el, 0);
  EXPECT_EQ(errors.edge_ratio_error, 0);
  EXPECT_EQ(errors.chamfer, 0);
}

// Moving everything by d = (0.03, 0, 0.04), |d| = 0.05: PMD = 0.05^2, mean 50 mm, max 0.05; no edge changes.
// Each point's nearest in the other set is its own copy (the square's side is 1): Chamfer = 0.05.
TEST(CompareMeshes, TranslationCountsFullyAndChangesNoEdge) {
  const Square square;
  Points moved = square.positions;
  moved.rowwise() += Eigen::RowVector3f(0.03f, 0, 0.04f);
  const MeshErrors errors = CompareMeshes(moved, square.positions, square.faces);
  EXPECT_NEAR(errors.pmd, 0.0025, 1e-8);
  EXPECT_NEAR(errors.centred_pmd, 0, 1e-8);
  EXPECT_NEAR(errors.mean_mm, 50, 1e-4);
  EXPECT_NEAR(errors.max_dist, 0.05, 1e-7);
  EXPECT_NEAR(errors.elr, 0, 1e-6);
  EXPECT_NEAR(errors.el, 0, 1e-12);
  EXPECT_NEAR(errors.edge_ratio_error, 0, 1e-6);
  EXPECT_NEAR(errors.chamfer, 0.05, 1e-7);
}

// Vertex 1 from (1, 0, 0) to (1.5, 0, 0): |v - v^| = 0.5 at one of four vertices.
//   PMD = 0.25 / 4, mean = 500 / 4 mm, max = 0.5 m.
//   Edge 0-1: squared 1 -> 2.25, |1 - 2.25| = 1.25.  Edge 1-2: squared 1 -> 0.25 + 1, |1 - 1.25| = 0.25.
//   ELR = (1.25 + 0.25) * 2 ends / 4 vertices = 0.75.
//   EL over the five edges = ((1.5 - 1)^2 + (sqrt(1.25) - 1)^2) / 5.
//   Ratio: face 0 has both edges, (0.5 + (sqrt(1.25) - 1) + 0) / 3; face 1 none; mean over two faces.
//   Chamfer: predicted to truth 0.5 / 4 (its nearest is still vertex 1); back 0.5 / 4.
TEST(CompareMeshes, OneMovedVertex) {
  const Square square;
  Points moved = square.positions;
  moved(1, 0) = 1.5f;
  const MeshErrors errors = CompareMeshes(moved, square.positions, square.faces);
  EXPECT_NEAR(errors.pmd, 0.0625, 1e-12);
  EXPECT_NEAR(errors.centred_pmd, 0.0625 - 0.125 * 0.125, 1e-12);  // the centroids are 0.5 / 4 apart
  EXPECT_NEAR(errors.mean_mm, 125, 1e-9);
  EXPECT_NEAR(errors.max_dist, 0.5, 1e-12);
  EXPECT_NEAR(errors.elr, 0.75, 1e-12);
  const double slant = std::sqrt(1.25) - 1;
  EXPECT_NEAR(errors.el, (0.25 + slant * slant) / 5, 1e-12);
  EXPECT_NEAR(errors.edge_ratio_error, (0.5 + slant) / 6, 1e-12);
  EXPECT_NEAR(errors.chamfer, 0.125, 1e-12);
}

// A 3-4-5 triangle doubled about its right angle at the origin: displacements 0, 3 and 4.
//   PMD = (0 + 9 + 16) / 3, mean = 7000 / 3 mm, max = 4.
//   Every squared edge is four times its truth: |1 - 4| = 3 per edge; each vertex has two: ELR = 6.
//   EL = (3^2 + 4^2 + 5^2) / 3; ratio |2 - 1| = 1.
TEST(CompareMeshes, ScaledTriangle) {
  const Points truth{{0, 0, 0}, {3, 0, 0}, {0, 4, 0}};
  const Points doubled = 2 * truth;
  const MeshErrors errors = CompareMeshes(doubled, truth, Faces{{0, 1, 2}});
  EXPECT_NEAR(errors.pmd, 25.0 / 3, 1e-12);
  EXPECT_NEAR(errors.mean_mm, 7000.0 / 3, 1e-9);
  EXPECT_NEAR(errors.max_dist, 4, 1e-12);
  EXPECT_NEAR(errors.elr, 6, 1e-12);
  EXPECT_NEAR(errors.el, 50.0 / 3, 1e-12);
  EXPECT_NEAR(errors.edge_ratio_error, 1, 1e-12);
  // Doubled to truth: 0, |(6,0)-(3,0)| = 3, |(0,8)-(0,4)| = 4. Back: 0; (3,0) is 3 from both (0,0) and (6,0);
  // (0,4) is 4 from both. Half of (7/3 + 7/3).
  EXPECT_NEAR(errors.chamfer, 7.0 / 3, 1e-12);
}

TEST(CompareMeshes, EdgesOfZeroTrueLengthAreSkippedByTheRatios) {
  Points truth{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}};
  Points predicted = truth;
  predicted(1, 1) = 1;  // edge 0-1: 0 -> 1; edge 1-2: 1 -> sqrt(2); edge 0-2 unchanged
  const MeshErrors errors = CompareMeshes(predicted, truth, Faces{{0, 1, 2}});
  EXPECT_NEAR(errors.elr, 2.0 * 1 / 3, 1e-12);
  EXPECT_NEAR(errors.edge_ratio_error, (std::sqrt(2.0) - 1) / 3, 1e-12);
  EXPECT_NEAR(errors.el, (1 + std::pow(std::sqrt(2.0) - 1, 2)) / 3, 1e-12);
}

TEST(ChamferDistance, IsSymmetricAndEqualsBruteForce) {
  const Points a = RandomPoints(300, 1), b = RandomPoints(200, 2);
  double forward = 0, backward = 0;
  for (int i = 0; i < a.rows(); ++i) {
    forward += (b.rowwise() - a.row(i)).cast<double>().rowwise().norm().minCoeff() / 300;
  }
  for (int i = 0; i < b.rows(); ++i) {
    backward += (a.rowwise() - b.row(i)).cast<double>().rowwise().norm().minCoeff() / 200;
  }
  EXPECT_NEAR(ChamferDistance(a, b), (forward + backward) / 2, 1e-6);
  EXPECT_DOUBLE_EQ(ChamferDistance(a, b), ChamferDistance(b, a));
}

TEST(ChamferDistance, CoincidentPointsAreFine) {
  const Points a = Points::Zero(100, 3), b = Points::Ones(50, 3);
  EXPECT_NEAR(ChamferDistance(a, b), std::sqrt(3.0), 1e-6);
}

// Two bones over two poses. Bone 0-1: lengths 1 and 3, mean 2, deviation 1. Bone 1-2: 2 and 2, deviation 0.
TEST(CompareBoneLengths, TwoPosesOfTwoBones) {
  const std::vector<Points> joints = {Points{{0, 0, 0}, {1, 0, 0}, {1, 2, 0}},
                                      Points{{0, 0, 0}, {3, 0, 0}, {3, 0, 2}}};
  const BoneLengthDeviation result = CompareBoneLengths(joints, {-1, 0, 1});
  EXPECT_NEAR(result.mean_length, 2, 1e-12);
  EXPECT_NEAR(result.max_deviation, 1, 1e-12);
  EXPECT_NEAR(result.mean_deviation, 0.5, 1e-12);
}

TEST(CompareBoneLengths, NoPosesGiveZero) { EXPECT_EQ(CompareBoneLengths({}, {-1, 0}).mean_length, 0); }

}  // namespace
}  // namespace stance
