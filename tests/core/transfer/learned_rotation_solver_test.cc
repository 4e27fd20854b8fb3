#include "core/transfer/learned_rotation_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <optional>

#include "core/base/random.h"
#include "tests/support/puppet.h"

namespace stance {
namespace {

const Skeleton& skeleton() { return HumanSkeleton(); }

Rotation RandomRotation(Random& random, double largest = 3.0) {
  const Eigen::Vector3f axis(static_cast<float>(random.Normal()), static_cast<float>(random.Normal()),
                             static_cast<float>(random.Normal()));
  return Eigen::AngleAxisf(static_cast<float>(random.Uniform(0, largest)), axis.normalized())
      .toRotationMatrix();
}

// The puppet's rig in that pose, its rotations and bones known.
Rig Posed(const std::vector<Rotation>& global) {
  const testing::Puppet rest = testing::MakePuppet();
  Rig rig = testing::Pose(rest, global).rig;
  rig.rotations = global;
  rig.bones = BoneVectors(skeleton(), rest.rig.joints);
  return rig;
}

// Limbs turn and twist as they like: backwards, too.
std::vector<Rotation> RandomPose(uint64_t seed) { return testing::RandomPose(seed, 3.0); }

std::vector<Rotation> Solve(const Rig& source, const Rig& reference, float correction = 0.75f) {
  return LearnedRotationSolver(correction, std::nullopt).Solve(skeleton(), {}, source, {}, reference);
}

float Difference(const std::vector<Rotation>& a, const std::vector<Rotation>& b) {
  float most = 0;
  for (size_t j = 0; j < a.size(); ++j) most = std::max(most, (a[j] - b[j]).cwiseAbs().maxCoeff());
  return most;
}

TEST(LearnedRotationSolver, OwnPoseIsTheIdentity) {
  const Rig rig = Posed(RandomPose(1));
  EXPECT_LT(Difference(Solve(rig, rig), std::vector<Rotation>(24, Rotation::Identity())), 1e-4f);
}

// With the truth of one identity in two poses, twist included, the answer is exact.
TEST(LearnedRotationSolver, TrueRotationsAreFound) {
  for (uint64_t seed = 1; seed < 6; ++seed) {
    const std::vector<Rotation> from = RandomPose(seed), to = RandomPose(seed + 100);
    std::vector<Rotation> expected(24);
    for (int j = 0; j < 24; ++j) expected[j] = to[j] * from[j].transpose();
    EXPECT_LT(Difference(Solve(Posed(from), Posed(to)), expected), 2e-3f);
  }
}

TEST(LearnedRotationSolver, ATurnedReferenceTurnsEveryRotation) {
  Random random(9);
  const Rotation turn = RandomRotation(random);
  const Rig source = Posed(RandomPose(2));
  const Rig reference = Posed(RandomPose(3));
  Rig turned = reference;
  turned.joints = reference.joints * turn.transpose();
  for (Rotation& rotation : turned.rotations) rotation = turn * rotation;
  std::vector<Rotation> expected = Solve(source, reference);
  for (Rotation& rotation : expected) rotation = turn * rotation;
  EXPECT_LT(Difference(Solve(source, turned), expected), 2e-3f);
}

// Bones of other directions and lengths at rest, in truth: the answer is exact all the same.
TEST(LearnedRotationSolver, SkeletonsMayDiffer) {
  const std::vector<Rotation> from = RandomPose(11), to = RandomPose(12);
  const Rig source = Posed(from);
  Rig reference = Posed(to);
  Random random(13);
  for (int j = 1; j < 24; ++j) {
    const int parent = skeleton().parents()[j];
    reference.bones.row(j) = reference.bones.row(j) * RandomRotation(random, 0.3).transpose() * 1.2f;
    reference.joints.row(j) = reference.joints.row(parent) + reference.bones.row(j) * to[parent].transpose();
  }
  std::vector<Rotation> expected(24);
  for (int j = 0; j < 24; ++j) expected[j] = to[j] * from[j].transpose();
  EXPECT_LT(Difference(Solve(source, reference), expected), 2e-3f);
}

// Fully corrected, whatever the learned rotations: single bones point where the reference's do, and the
// answer is a rotation.
TEST(LearnedRotationSolver, BonesPointAsTheReferencesDo) {
  Random random(4);
  Rig source = Posed(RandomPose(5)), reference = Posed(RandomPose(6));
  for (Rotation& rotation : reference.rotations) rotation = RandomRotation(random);
  const std::vector<Rotation> rotations = Solve(source, reference, 1);
  for (int j = 0; j < 24; ++j) {
    EXPECT_LT((rotations[j] * rotations[j].transpose() - Rotation::Identity()).norm(), 1e-4f);
    EXPECT_NEAR(rotations[j].determinant(), 1, 1e-4f);
    if (skeleton().children(j).size() != 1) continue;
    const int child = skeleton().children(j)[0];
    const Eigen::Vector3f from = (source.joints.row(child) - source.joints.row(j)).transpose().normalized();
    const Eigen::Vector3f to =
        (reference.joints.row(child) - reference.joints.row(j)).transpose().normalized();
    EXPECT_LT((rotations[j] * from - to).norm(), 1e-3f);
  }
}

TEST(LearnedRotationSolver, CoincidentJointsKeepTheLearnedRotation) {
  Rig source = Posed(RandomPose(7)), reference = Posed(RandomPose(8));
  source.joints.setZero();
  const std::vector<Rotation> rotations = Solve(source, reference);
  for (int j = 0; j < 24; ++j) {
    EXPECT_LT((rotations[j] - reference.rotations[j] * source.rotations[j].transpose()).norm(), 1e-4f);
  }
}

// An elbow that the network bends backwards ends within the limits, in the source and in the reference.
TEST(LearnedRotationSolver, HyperextensionIsDrawnBack) {
  std::vector<Rotation> local(24, Rotation::Identity());
  const Rig rest = Posed(local);
  local[kLeftElbow] = Eigen::AngleAxisf(0.7f, Eigen::Vector3f::UnitY()).toRotationMatrix();
  const Rig backwards = Posed(GlobalRotations(skeleton(), local));
  const HingeLimit limit;
  for (const bool in_source : {false, true}) {
    const Rig &source = in_source ? backwards : rest, &reference = in_source ? rest : backwards;
    const Rotation turn = LearnedRotationSolver().Solve(skeleton(), {}, source, {}, reference)[kLeftElbow];
    EXPECT_LT(Eigen::AngleAxisf(turn).angle(), limit.free + limit.margin + 1e-3f);
    EXPECT_GT(Eigen::AngleAxisf(turn).angle(), limit.free);
    EXPECT_NEAR(Eigen::AngleAxisf(Solve(source, reference)[kLeftElbow]).angle(), 0.7f, 1e-3f);
  }
}

}  // namespace
}  // namespace stance
