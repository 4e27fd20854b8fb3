#include "core/mesh/laplacian.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/mesh/measure.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

std::vector<TriangleMesh> AllShapes() {
  return {testing::Icosphere(3),
          testing::Box(1, 2, 3),
          testing::Grid(5, 7),
          testing::Fan(4),
          testing::TwoSpheres(),
          testing::WithDegenerateFaces(),
          testing::Unwelded(testing::Box())};
}

TEST(CotangentLaplacian, IsASymmetricMMatrixWithZeroRowSums) {
  for (const TriangleMesh& mesh : AllShapes()) {
    const SparseMatrix l = CotangentLaplacian(mesh.positions, mesh.faces);
    ASSERT_EQ(l.rows(), mesh.vertex_count());
    EXPECT_LT((l - SparseMatrix(l.transpose())).norm(), 1e-12);
    EXPECT_LT((l * Eigen::VectorXd::Ones(l.cols())).cwiseAbs().maxCoeff(), 1e-9);
    for (int64_t c = 0; c < l.outerSize(); ++c) {
      for (SparseMatrix::InnerIterator it(l, c); it; ++it) {
        ASSERT_TRUE(std::isfinite(it.value()));
        EXPECT_GE(it.row() == it.col() ? it.value() : -it.value(), 0);
      }
    }
  }
}

TEST(CotangentLaplacian, OfAnEquilateralTriangleIsByHand) {
  Points v(3, 3);
  v << 0, 0, 0, 1, 0, 0, 0.5f, std::sqrt(3.0f) / 2, 0;
  Faces f(1, 3);
  f << 0, 1, 2;
  const Eigen::MatrixXd l = CotangentLaplacian(v, f);
  const double w = 0.5 / std::sqrt(3.0);  // cot 60 / 2
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(l(i, j), i == j ? 2 * w : -w, 1e-6);
  }
}

TEST(CotangentLaplacian, KillsLinearFunctionsInsideAFlatMesh) {
  // Delaunay, so no cotangent sum is negative and nothing is clamped; diagonals have cot 90 + cot 90 = 0.
  const TriangleMesh grid = testing::Grid(6, 6);
  const SparseMatrix l = CotangentLaplacian(grid.positions, grid.faces);
  const Eigen::VectorXd f =
      2 * grid.positions.col(0).cast<double>() - 3 * grid.positions.col(1).cast<double>();
  const Eigen::VectorXd lf = l * f;
  for (int64_t v = 0; v < grid.vertex_count(); ++v) {
    const float x = grid.positions(v, 0), y = grid.positions(v, 1);
    if (x > 0.01f && x < 0.99f && y > 0.01f && y < 0.99f) {
      EXPECT_NEAR(lf[v], 0, 2e-3);  // kMinEdge on the diagonals
    }
  }
}

TEST(CotangentLaplacian, DoesNotChangeWithRigidMotionOrScale) {
  TriangleMesh mesh = testing::Icosphere(2);
  const SparseMatrix before = CotangentLaplacian(mesh.positions, mesh.faces);
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(0.7f, Eigen::Vector3f(1, 2, 3).normalized()).toRotationMatrix();
  mesh.positions = (mesh.positions * turn.transpose() * 2.5f).rowwise() + Eigen::RowVector3f(1, 2, 3);
  EXPECT_LT((CotangentLaplacian(mesh.positions, mesh.faces) - before).norm(), 1e-3);
}

TEST(CotangentLaplacian, OfACoordinateOnASphereIsTwiceItself) {
  // Continuous: -Laplace-Beltrami of x on the unit sphere is 2x; discrete: L_c x = 2 M x.
  const TriangleMesh sphere = testing::Icosphere(5);
  const SparseMatrix l = CotangentLaplacian(sphere.positions, sphere.faces);
  const Eigen::VectorXd mass = VertexAreas(sphere.positions, sphere.faces);
  const Eigen::VectorXd x = sphere.positions.col(0).cast<double>();
  EXPECT_LT((l * x - 2 * mass.cwiseProduct(x)).norm() / mass.cwiseProduct(x).norm(), 0.05);
}

}  // namespace
}  // namespace stance
