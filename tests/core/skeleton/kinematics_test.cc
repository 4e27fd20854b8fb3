#include "core/skeleton/kinematics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <numbers>

#include "core/base/random.h"

namespace stance {
namespace {

Rotation RandomRotation(Random& random) {
  const Eigen::Vector4d q(random.Normal(), random.Normal(), random.Normal(), random.Normal());
  return Eigen::Quaterniond(q.normalized()).toRotationMatrix().cast<float>();
}

Eigen::Vector3f RandomDirection(Random& random) {
  return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized().cast<float>();
}

Points RandomJoints(Random& random) {
  return Points(kHumanJoints, 3).unaryExpr([&](float) { return static_cast<float>(random.Normal()); });
}

void ExpectRotation(const Rotation& r) {
  EXPECT_LT((r * r.transpose() - Rotation::Identity()).norm(), 1e-5f);
  EXPECT_NEAR(r.determinant(), 1, 1e-5);
}

TEST(GlobalRotations, OfIdentitiesAreIdentities) {
  const std::vector<Rotation> local(kHumanJoints, Rotation::Identity());
  for (const Rotation& r : GlobalRotations(HumanSkeleton(), local)) EXPECT_EQ(r, Rotation::Identity());
}

TEST(PoseTransforms, IdentityRotationsMoveNothing) {
  Random random(1);
  const Points joints = RandomJoints(random);
  const std::vector<Rotation> global(kHumanJoints, Rotation::Identity());
  for (const auto& transform : PoseTransforms(HumanSkeleton(), joints, global)) {
    EXPECT_LT(transform.translation.norm(), 1e-6f);
  }
}

TEST(PoseTransforms, KeepTheRootAndEveryBoneLengthAndConnectBones) {
  Random random(2);
  const Points joints = RandomJoints(random);
  std::vector<Rotation> global;
  for (int j = 0; j < kHumanJoints; ++j) global.push_back(RandomRotation(random));
  const auto transforms = PoseTransforms(HumanSkeleton(), joints, global);
  EXPECT_LT((transforms[0].Apply(joints.row(0)) - joints.row(0).transpose()).norm(), 1e-5f);
  for (int j = 1; j < kHumanJoints; ++j) {
    const int parent = HumanSkeleton().parents()[j];
    const Eigen::Vector3f posed = transforms[j].Apply(joints.row(j)),
                          start = transforms[parent].Apply(joints.row(parent));
    EXPECT_NEAR((posed - start).norm(), (joints.row(j) - joints.row(parent)).norm(), 1e-4f);
    EXPECT_LT((posed - transforms[parent].Apply(joints.row(j))).norm(), 1e-4f);  // equation 8
  }
}

TEST(PoseTransforms, PosingThenPosingBackIsTheIdentity) {
  Random random(3);
  const Points joints = RandomJoints(random);
  std::vector<Rotation> forward, backward;
  for (int j = 0; j < kHumanJoints; ++j) {
    forward.push_back(RandomRotation(random));
    backward.push_back(forward.back().transpose());
  }
  const auto there = PoseTransforms(HumanSkeleton(), joints, forward);
  Points posed(kHumanJoints, 3);
  for (int j = 0; j < kHumanJoints; ++j) posed.row(j) = there[j].Apply(joints.row(j)).transpose();
  const auto back = PoseTransforms(HumanSkeleton(), posed, backward);
  for (int j = 0; j < kHumanJoints; ++j) {
    const Eigen::Vector3f point = RandomDirection(random);
    EXPECT_LT((back[j].Apply(there[j].Apply(point)) - point).norm(), 1e-4f);
  }
}

TEST(NearestRotation, OfARotationIsItself) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    const Rotation r = RandomRotation(random);
    EXPECT_LT((NearestRotation(r * 3.0f) - r).norm(), 1e-5f);
  }
}

TEST(NearestRotation, IsNeverAReflection) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Matrix3f reflection = RandomRotation(random) * Eigen::Vector3f(1, 1, -1).asDiagonal();
    ExpectRotation(NearestRotation(reflection));
  }
}

TEST(NearestRotation, OfNothingUsefulIsTheIdentity) {
  EXPECT_EQ(NearestRotation(Eigen::Matrix3f::Zero()), Rotation::Identity());
  EXPECT_EQ(NearestRotation(Eigen::Matrix3f::Constant(std::numeric_limits<float>::quiet_NaN())),
            Rotation::Identity());
}

TEST(SmallestRotation, CarriesOneDirectionOntoTheOther) {
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3f from = RandomDirection(random) * 2, to = RandomDirection(random) * 0.1f;
    const Rotation r = SmallestRotation(from, to);
    ExpectRotation(r);
    EXPECT_LT((r * from.normalized() - to.normalized()).norm(), 1e-5f);
    // Smallest: it turns about the axis perpendicular to both.
    const Eigen::Vector3f axis = from.cross(to).normalized();
    EXPECT_LT((r * axis - axis).norm(), 1e-4f);
  }
}

TEST(SmallestRotation, HandlesParallelOppositeAndVanishingVectors) {
  const Eigen::Vector3f x = Eigen::Vector3f::UnitX();
  EXPECT_LT((SmallestRotation(x, 5 * x) - Rotation::Identity()).norm(), 1e-6f);
  EXPECT_EQ(SmallestRotation(Eigen::Vector3f::Zero(), x), Rotation::Identity());
  EXPECT_EQ(SmallestRotation(x, Eigen::Vector3f::Zero()), Rotation::Identity());
  for (const Eigen::Vector3f& direction :
       {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(0, 1, 0), Eigen::Vector3f(1, -2, 3)}) {
    const Rotation half = SmallestRotation(direction, -direction);
    ExpectRotation(half);
    EXPECT_LT((half * direction + direction).norm(), 1e-5f * direction.norm());
  }
}

TEST(SmallestRotation, StaysARotationNearTheHalfTurn) {
  // acos would leave [-1, 1] here (paper A's trap).
  for (const float tilt : {1e-3f, 1e-5f, 1e-7f, 1e-9f}) {
    const Rotation r = SmallestRotation(Eigen::Vector3f::UnitX(), Eigen::Vector3f(-1, tilt, 0));
    ASSERT_TRUE(r.allFinite());
    ExpectRotation(r);
  }
}

}  // namespace
}  // namespace stance
