#include "core/transfer/bone_rotation_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/puppet.h"

namespace stance {
namespace {

using testing::MakePuppet;
using testing::Pose;
using testing::Puppet;

std::vector<Rotation> Solve(const Puppet& source, const Puppet& reference, Twist twist = Twist::kPaper) {
  return BoneRotationSolver(twist).Solve(HumanSkeleton(), source.mesh, source.rig, reference.mesh,
                                         reference.rig);
}

Puppet Apply(const Puppet& source, const std::vector<Rotation>& rotations) { return Pose(source, rotations); }

float Distance(const Puppet& a, const Puppet& b) {
  return (a.mesh.positions - b.mesh.positions).rowwise().norm().maxCoeff();
}

class EitherTwist : public ::testing::TestWithParam<Twist> {};
INSTANTIATE_TEST_SUITE_P(Rules, EitherTwist, ::testing::Values(Twist::kPaper, Twist::kInherited));

TEST_P(EitherTwist, OwnPoseGivesIdentities) {
  const Puppet puppet = Pose(MakePuppet(), testing::RandomPose(1, 0.8));
  for (const Rotation& r : Solve(puppet, puppet, GetParam()))
    EXPECT_LT((r - Rotation::Identity()).norm(), 1e-4f);
}

TEST_P(EitherTwist, EverySolvedBonePointsAsTheReferences) {
  const Puppet source = MakePuppet(), reference = Pose(source, testing::RandomPose(2, 0.9));
  const Puppet target = Apply(source, Solve(source, reference, GetParam()));
  for (int j = 0; j < kHumanJoints; ++j) {
    if (HumanSkeleton().children(j).size() != 1) continue;
    const int child = HumanSkeleton().children(j)[0];
    const Eigen::RowVector3f got = (target.rig.joints.row(child) - target.rig.joints.row(j)).normalized();
    const Eigen::RowVector3f wanted =
        (reference.rig.joints.row(child) - reference.rig.joints.row(j)).normalized();
    EXPECT_LT((got - wanted).norm(), 1e-3f) << HumanSkeleton().names()[j];
  }
}

TEST(BoneRotationSolver, RecoversARotatedReferenceExactlyAtTheForks) {
  const Puppet source = MakePuppet();
  const Rotation turn =
      Eigen::AngleAxisf(1.0f, Eigen::Vector3f(0.3f, 1, -0.2f).normalized()).toRotationMatrix();
  const auto rotations = Solve(source, Pose(source, std::vector<Rotation>(kHumanJoints, turn)));
  EXPECT_LT((rotations[kPelvis] - turn).norm(), 1e-4f);
  EXPECT_LT((rotations[kSpine3] - turn).norm(), 1e-4f);
}

TEST(BoneRotationSolver, ARotatedReferenceRotatesTheTargetWhenTwistIsInherited) {
  const Puppet source = MakePuppet();
  const Rotation turn =
      Eigen::AngleAxisf(2.5f, Eigen::Vector3f(0.3f, 1, -0.2f).normalized()).toRotationMatrix();
  const Puppet reference = Pose(source, std::vector<Rotation>(kHumanJoints, turn));
  EXPECT_LT(Distance(Apply(source, Solve(source, reference, Twist::kInherited)), reference), 1e-3f);
  // The paper's rule puts every joint right and loses the twist: joints coincide, balls beside them may not.
  const Puppet paper = Apply(source, Solve(source, reference, Twist::kPaper));
  EXPECT_LT((paper.rig.joints - reference.rig.joints).rowwise().norm().maxCoeff(), 1e-3f);
}

TEST(BoneRotationSolver, ScaleAndPlaceOfTheReferenceDoNotMatter) {
  const Puppet source = MakePuppet();
  Puppet reference = Pose(source, testing::RandomPose(3, 0.7));
  const auto before = Solve(source, reference);
  reference.mesh.positions = (reference.mesh.positions * 3).rowwise() + Eigen::RowVector3f(1, 2, 3);
  reference.rig.joints = (reference.rig.joints * 3).rowwise() + Eigen::RowVector3f(1, 2, 3);
  const auto after = Solve(source, reference);
  for (int j = 0; j < kHumanJoints; ++j) EXPECT_LT((before[j] - after[j]).norm(), 1e-3f);
}

TEST_P(EitherTwist, SurvivesEveryDegeneracy) {
  const Puppet source = MakePuppet();
  Puppet opposite = source;  // every bone reversed
  opposite.rig.joints *= -1;
  opposite.mesh.positions *= -1;
  Puppet collapsed = source;  // all joints in one point
  collapsed.rig.joints.rowwise() = Eigen::RowVector3f(0, 1, 0);
  Puppet unbound = source;  // every vertex bound to the pelvis: leaves without vertices
  unbound.rig.weights.setZero();
  unbound.rig.weights.col(0).setOnes();
  const std::vector<const Puppet*> puppets = {&source, &opposite, &collapsed, &unbound};
  for (const Puppet* a : puppets) {
    for (const Puppet* b : puppets) {
      for (const Rotation& r : Solve(*a, *b, GetParam())) {
        ASSERT_TRUE(r.allFinite());
        EXPECT_NEAR(r.determinant(), 1, 1e-3);
        EXPECT_LT((r * r.transpose() - Rotation::Identity()).norm(), 1e-3f);
      }
    }
  }
}

TEST(VirtualChildren, AreTheMeansOfTheBoundVertices) {
  Points v(3, 3);
  v << 0, 0, 0, 2, 0, 0, 0, 5, 0;
  RowMatrix w(3, 3);
  w << 1, 0, 0, 1, 0, 0, 0, 1, 0;
  const Points children = VirtualChildren(v, w);
  EXPECT_EQ(children.row(0), Eigen::RowVector3f(1, 0, 0));
  EXPECT_EQ(children.row(1), Eigen::RowVector3f(0, 5, 0));
  EXPECT_TRUE(children.row(2).hasNaN());
}

}  // namespace
}  // namespace stance
