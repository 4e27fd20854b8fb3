#include "core/transfer/pose_refinement.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>

#include "core/transfer/linear_blend_skinning.h"

namespace stance {
namespace {

// An estimate of 40 samples, each bound to one joint, with bones and rotations at random and joints where
// these put them.
PoseEstimate RandomEstimate() {
  std::srand(9);
  PoseEstimate estimate;
  estimate.weights = RowMatrix::Zero(40, kHumanJoints);
  for (int i = 0; i < 40; ++i) estimate.weights(i, i % kHumanJoints) = 1;
  estimate.bones = 0.3f * Points::Random(kHumanJoints, 3);
  estimate.bones.row(kPelvis).setZero();
  for (int j = 0; j < kHumanJoints; ++j) {
    estimate.rotations.emplace_back(Eigen::Quaternionf::UnitRandom().toRotationMatrix());
  }
  estimate.joints = Points::Random(kHumanJoints, 3);
  estimate.confidence = Eigen::VectorXf::Constant(kHumanJoints, 0.5f);
  return estimate;
}

// Points and normals at rest, and the same in the estimate's pose.
struct Posed {
  PyramidInput rest, input;
};

Posed PoseBy(const PoseEstimate& estimate) {
  Posed posed;
  posed.rest.points = Points::Random(estimate.weights.rows(), 3);
  posed.rest.normals = Points::Random(estimate.weights.rows(), 3);
  posed.rest.normals.rowwise().normalize();
  const std::vector<AffineTransform> transforms = PoseAgain(estimate);
  std::vector<AffineTransform> turns = transforms;
  for (AffineTransform& turn : turns) turn.translation.setZero();
  posed.input.points = LinearBlendSkinning().Deform(posed.rest.points, estimate.weights, transforms);
  posed.input.normals = LinearBlendSkinning().Deform(posed.rest.normals, estimate.weights, turns);
  return posed;
}

TEST(RestJoints, HaveTheBones) {
  const PoseEstimate estimate = RandomEstimate();
  EXPECT_LT((BoneVectors(HumanSkeleton(), RestJoints(estimate.bones)) - estimate.bones).norm(), 1e-5f);
}

TEST(UnposedInput, UndoesAPose) {
  const PoseEstimate estimate = RandomEstimate();
  const Posed posed = PoseBy(estimate);
  const PyramidInput unposed = UnposedInput(posed.input, estimate);
  EXPECT_LT((unposed.points - posed.rest.points).cwiseAbs().maxCoeff(), 1e-5f);
  EXPECT_LT((unposed.normals - posed.rest.normals).cwiseAbs().maxCoeff(), 1e-5f);
}

// Two views of one mesh, once unposed, are one.
TEST(UnposedInput, DoesNotDependOnWhereTheMeshStands) {
  PoseEstimate estimate = RandomEstimate();
  PyramidInput input = PoseBy(estimate).input;
  const PyramidInput before = UnposedInput(input, estimate);
  const Rotation turn = Eigen::Quaternionf::UnitRandom().toRotationMatrix();
  for (Points* points : {&input.points, &input.normals, &estimate.joints}) {
    *points = (*points * turn.transpose()).eval();
  }
  for (Rotation& rotation : estimate.rotations) rotation = turn * rotation;
  const Eigen::RowVector3f shift(1, 2, 3);
  input.points.rowwise() += shift;
  estimate.joints.rowwise() += shift;
  const PyramidInput after = UnposedInput(input, estimate);
  EXPECT_LT((after.points - before.points).cwiseAbs().maxCoeff(), 1e-5f);
  EXPECT_LT((after.normals - before.normals).cwiseAbs().maxCoeff(), 1e-5f);
}

TEST(UnposedInput, ANormalThatCancelsIsZero) {
  PoseEstimate estimate = RandomEstimate();
  estimate.rotations[kPelvis] = Rotation::Identity();
  estimate.rotations[kLeftHip] = Eigen::AngleAxisf(M_PIf, Eigen::Vector3f::UnitX()).toRotationMatrix();
  PyramidInput input = PoseBy(estimate).input;
  estimate.weights.row(0).setZero();
  estimate.weights(0, kPelvis) = estimate.weights(0, kLeftHip) = 0.5f;
  input.normals.row(0) = Eigen::RowVector3f::UnitY();
  EXPECT_LT(UnposedInput(input, estimate).normals.row(0).norm(), 1e-12f);
}

TEST(EstimateBehindUnposing, AnEstimateThatUnposesWellStays) {
  const PoseEstimate first = RandomEstimate();
  PoseEstimate seen = first;
  seen.joints = RestJoints(first.bones);
  for (Rotation& rotation : seen.rotations) rotation = Rotation::Identity();
  seen.confidence.setConstant(0.9f);
  const PoseEstimate behind = EstimateBehindUnposing(seen, first);
  EXPECT_LT((behind.joints - first.joints).cwiseAbs().maxCoeff(), 1e-5f);
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_LT((behind.rotations[j] - first.rotations[j]).norm(), 1e-5f);
  }
  EXPECT_EQ(behind.confidence, seen.confidence);
}

TEST(EstimateBehindUnposing, AJointThatTurnsBesidesTurnsInItsOwnFrame) {
  const PoseEstimate first = RandomEstimate();
  PoseEstimate seen = first;
  const Rotation besides = Eigen::Quaternionf::UnitRandom().toRotationMatrix();
  seen.rotations[kLeftElbow] = besides;
  const PoseEstimate behind = EstimateBehindUnposing(seen, first);
  EXPECT_LT((behind.rotations[kLeftElbow] - first.rotations[kLeftElbow] * besides).norm(), 1e-5f);
}

}  // namespace
}  // namespace stance
