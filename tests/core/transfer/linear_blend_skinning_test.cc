#include "core/transfer/linear_blend_skinning.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/puppet.h"

namespace stance {
namespace {

AffineTransform Rigid(float angle, const Eigen::Vector3f& translation) {
  return {Eigen::AngleAxisf(angle, Eigen::Vector3f(1, 2, -1).normalized()).toRotationMatrix(), translation};
}

RowMatrix RandomWeights(int64_t rows, int64_t joints) {
  RowMatrix w = RowMatrix::Random(rows, joints).cwiseAbs();
  w.array().colwise() /= w.rowwise().sum().array();
  return w;
}

TEST(LinearBlendSkinning, IdentityTransformsMoveNothing) {
  const Points v = Points::Random(100, 3);
  const std::vector<AffineTransform> transforms(5);
  EXPECT_LT((LinearBlendSkinning().Deform(v, RandomWeights(100, 5), transforms) - v).cwiseAbs().maxCoeff(),
            1e-6f);
}

TEST(LinearBlendSkinning, OneCommonTransformMovesRigidly) {
  const Points v = Points::Random(100, 3);
  const AffineTransform rigid = Rigid(0.8f, {1, 2, 3});
  const Points out =
      LinearBlendSkinning().Deform(v, RandomWeights(100, 5), std::vector<AffineTransform>(5, rigid));
  for (int64_t i = 0; i < 100; ++i) EXPECT_LT((out.row(i).transpose() - rigid.Apply(v.row(i))).norm(), 1e-5f);
}

TEST(LinearBlendSkinning, IsEquation10) {
  Points v(1, 3);
  v << 1, 2, 3;
  RowMatrix w(1, 2);
  w << 0.25f, 0.75f;
  const AffineTransform a = Rigid(0.5f, {1, 0, 0}), b = Rigid(-1.0f, {0, 1, 0});
  const Points out = LinearBlendSkinning().Deform(v, w, std::vector<AffineTransform>{a, b});
  const Eigen::Vector3f p(1, 2, 3);
  EXPECT_LT((out.row(0).transpose() - (0.25f * a.Apply(p) + 0.75f * b.Apply(p))).norm(), 1e-6f);
}

TEST(LinearBlendSkinning, APermutationOfTheVerticesPermutesTheOutput) {
  const testing::Puppet puppet = testing::MakePuppet();
  const auto transforms = PoseTransforms(HumanSkeleton(), puppet.rig.joints, testing::RandomPose(1, 0.5));
  const Points out = LinearBlendSkinning().Deform(puppet.mesh.positions, puppet.rig.weights, transforms);
  const Points reversed = LinearBlendSkinning().Deform(puppet.mesh.positions.colwise().reverse(),
                                                       puppet.rig.weights.colwise().reverse(), transforms);
  EXPECT_EQ(Points(reversed.colwise().reverse()), out);
}

TEST(DeformNormals, TurnsAndStaysUnit) {
  Points normals(2, 3);
  normals << 0, 0, 1, 0, 0, 0;
  const AffineTransform rigid = Rigid(0.8f, {1, 2, 3});
  const Points out = DeformNormals(normals, RandomWeights(2, 5), std::vector<AffineTransform>(5, rigid));
  EXPECT_LT((out.row(0).transpose() - rigid.linear.col(2)).norm(), 1e-5f);
  EXPECT_EQ(out.row(1).norm(), 0);
}

}  // namespace
}  // namespace stance
