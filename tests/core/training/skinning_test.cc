#include "core/training/skinning.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace stance {
namespace {

TEST(Skinning, IdentityTransformsLeaveThePoints) {
  const Points points = Points::Random(20, 3);
  RowMatrix weights = RowMatrix::Random(20, 4).cwiseAbs();
  for (int v = 0; v < 20; ++v) weights.row(v) /= weights.row(v).sum();
  EXPECT_TRUE(SkinPoints(points, weights, std::vector<AffineTransform>(4)).isApprox(points, 1e-6f));
}

TEST(Skinning, OneRigidMotionMovesAllPointsRigidly) {
  const Points points = Points::Random(20, 3);
  RowMatrix weights = RowMatrix::Random(20, 3).cwiseAbs();
  for (int v = 0; v < 20; ++v) weights.row(v) /= weights.row(v).sum();
  AffineTransform motion;
  motion.linear = Eigen::AngleAxisf(1.0f, Eigen::Vector3f(1, 2, 3).normalized()).toRotationMatrix();
  motion.translation = {1, -2, 3};
  const Points moved = SkinPoints(points, weights, {motion, motion, motion});
  for (int v = 0; v < 20; ++v) {
    EXPECT_LT((moved.row(v).transpose() - motion.Apply(points.row(v).transpose())).norm(), 1e-5f);
  }
}

TEST(Skinning, BlendsByTheWeights) {
  Points point(1, 3);
  point << 1, 0, 0;
  RowMatrix weights(1, 2);
  weights << 0.25f, 0.75f;
  std::vector<AffineTransform> transforms(2);
  transforms[1].translation = {0, 4, 0};
  EXPECT_TRUE(SkinPoints(point, weights, transforms).row(0).isApprox(Eigen::RowVector3f(1, 3, 0)));
}

}  // namespace
}  // namespace stance
