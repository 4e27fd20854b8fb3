#include "core/transfer/rotation_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/puppet.h"

namespace stance {
namespace {

const Skeleton& skeleton() { return HumanSkeleton(); }

std::vector<Rotation> Fit(const testing::Puppet& puppet, const Points& to) {
  const Eigen::VectorXd mass = Eigen::VectorXd::Ones(to.rows());
  return FitRotations(skeleton(), {puppet.mesh.positions, to, puppet.rig.weights, mass});
}

TEST(FitRotations, OfAPosedPuppetAreThePoses) {
  const testing::Puppet puppet = testing::MakePuppet();
  const std::vector<Rotation> global = testing::RandomPose(1, 1.0);
  const std::vector<Rotation> found = Fit(puppet, testing::Pose(puppet, global).mesh.positions);
  for (size_t j = 0; j < found.size(); ++j) EXPECT_LT((found[j] - global[j]).norm(), 0.01f) << j;
}

TEST(FitRotations, OfAMovedAndScaledMeshAreItsTurn) {
  const testing::Puppet puppet = testing::MakePuppet();
  const Rotation turn = Eigen::AngleAxisf(2, Eigen::Vector3f(1, 2, 3).normalized()).toRotationMatrix();
  const Points moved =
      (1.3f * puppet.mesh.positions * turn.transpose()).rowwise() + Eigen::RowVector3f(1, -2, 3);
  for (const Rotation& rotation : Fit(puppet, moved)) EXPECT_LT((rotation - turn).norm(), 0.01f);
}

TEST(FitRotations, OfAJointWithoutVerticesIsItsParents) {
  testing::Puppet puppet = testing::MakePuppet();
  puppet.rig.weights.col(kLeftElbow) += puppet.rig.weights.col(kLeftWrist);
  puppet.rig.weights.col(kLeftWrist).setZero();
  const std::vector<Rotation> global = testing::RandomPose(2, 0.5);
  const std::vector<Rotation> found = Fit(puppet, testing::Pose(puppet, global).mesh.positions);
  EXPECT_EQ(found[kLeftWrist], found[kLeftElbow]);
  // All of the surface shrunk to a point leaves nothing else, either.
  for (const Rotation& rotation : Fit(puppet, Points::Zero(puppet.mesh.vertex_count(), 3))) {
    EXPECT_LT((rotation - Rotation::Identity()).norm(), 1e-5f);
  }
}

// A line's turn about itself is nobody's to see: it goes with the parent's.
TEST(FitRotations, OfALineFollowTheParentAboutIt) {
  const int line = 5;
  const Points from = testing::MakePuppet().mesh.positions;
  Points both(from.rows() + line, 3);
  both.topRows(from.rows()) = from;
  for (int i = 0; i < line; ++i) both.row(from.rows() + i) << 0.1f * static_cast<float>(i), 0, 0;
  RowMatrix weights = RowMatrix::Zero(both.rows(), kHumanJoints);
  weights.col(kPelvis).head(from.rows()).setOnes();
  weights.col(kLeftHip).tail(line).setOnes();
  const Rotation turn = Eigen::AngleAxisf(1, Eigen::Vector3f::UnitX()).toRotationMatrix();
  const Points to = both * turn.transpose();
  const std::vector<Rotation> found =
      FitRotations(skeleton(), {both, to, weights, Eigen::VectorXd::Ones(both.rows())});
  EXPECT_LT((found[kPelvis] - turn).norm(), 0.01f);
  EXPECT_LT((found[kLeftHip] - turn).norm(), 0.01f);
}

}  // namespace
}  // namespace stance
