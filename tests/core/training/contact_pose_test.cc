#include "core/training/contact_pose.h"

#include <gtest/gtest.h>

#include "core/skeleton/skeleton.h"
#include "core/training/pose_sampler.h"
#include "core/training/skinning.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

Points Posed(const Points& rest, const std::vector<Rotation>& local) {
  return TransformJoints(rest,
                         PoseTransforms(HumanSkeleton(), rest, GlobalRotations(HumanSkeleton(), local)));
}

TEST(ContactPose, TheWristReachesItsTarget) {
  const Points rest = testing::TPoseJoints();
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    std::vector<Rotation> local = SamplePose(random, PoseMix::kHard, MotionLibrary({}), Split::kTrain, rest);
    const bool left = i % 2 == 0;
    const Points before = Posed(rest, local);
    const Eigen::Vector3f shoulder = before.row(left ? kLeftShoulder : kRightShoulder).transpose();
    const Eigen::Vector3f direction(static_cast<float>(random.Normal()), static_cast<float>(random.Normal()),
                                    static_cast<float>(random.Normal()));
    const Eigen::Vector3f target = shoulder + 0.3f * direction.normalized();
    ReachWith(left, target, {0, -1, 0}, rest, local);
    const Points after = Posed(rest, local);
    EXPECT_LT((after.row(left ? kLeftWrist : kRightWrist).transpose() - target).norm(), 1e-3f) << i;
    EXPECT_LT(
        (after.row(left ? kRightWrist : kLeftWrist) - before.row(left ? kRightWrist : kLeftWrist)).norm(),
        1e-4f);
  }
}

TEST(ContactPose, ATargetOutOfReachIsPointedAt) {
  const Points rest = testing::TPoseJoints();
  std::vector<Rotation> local(kHumanJoints, Rotation::Identity());
  const Eigen::Vector3f shoulder = rest.row(kLeftShoulder).transpose(), target(0.3f, 5, 1);
  ReachWith(true, target, {0, -1, 0}, rest, local);
  const Points posed = Posed(rest, local);
  const Eigen::Vector3f arm = posed.row(kLeftWrist).transpose() - shoulder;
  EXPECT_GT(arm.normalized().dot((target - shoulder).normalized()), 0.9999f);
}

TEST(ContactPose, TheElbowFollowsItsHint) {
  const Points rest = testing::TPoseJoints();
  for (const float sign : {-1.0f, 1.0f}) {
    std::vector<Rotation> local(kHumanJoints, Rotation::Identity());
    const Eigen::Vector3f shoulder = rest.row(kRightShoulder).transpose();
    ReachWith(false, shoulder + Eigen::Vector3f(0, 0, 0.25f), {0, sign, 0}, rest, local);
    EXPECT_GT(sign * (Posed(rest, local)(kRightElbow, 1) - shoulder.y()), 0.1f);
  }
}

TEST(ContactPose, HandsComeToTheBody) {
  const Points rest = testing::TPoseJoints();
  for (int i = 0; i < 200; ++i) {
    Random random(2, i);
    std::vector<Rotation> local(kHumanJoints, Rotation::Identity());
    PlaceHands(random, rest, local);
    const Points posed = Posed(rest, local);
    for (const int wrist : {kLeftWrist, kRightWrist}) {
      float nearest = 9;
      for (const int joint :
           {kPelvis, kSpine1, kSpine2, kSpine3, kHead, kLeftHip, kRightHip, kLeftKnee, kRightKnee}) {
        nearest = std::min(nearest, (posed.row(wrist) - posed.row(joint)).norm());
      }
      EXPECT_LT(nearest, 0.45f) << i;
    }
  }
}

}  // namespace
}  // namespace stance
