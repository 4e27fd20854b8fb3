#include "core/training/pose_sampler.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/skeleton/skeleton.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

TEST(PoseSampler, EveryMixGivesRotations) {
  const Points rest = testing::TPoseJoints();
  const MotionLibrary none({});
  for (const PoseMix mix : {PoseMix::kModerate, PoseMix::kHard, PoseMix::kTraining}) {
    for (int i = 0; i < 200; ++i) {
      Random random(1, i);
      const std::vector<Rotation> local = SamplePose(random, mix, none, Split::kTrain, rest);
      ASSERT_EQ(local.size(), static_cast<size_t>(kHumanJoints));
      for (const Rotation& rotation : local) {
        EXPECT_TRUE((rotation * rotation.transpose()).isIdentity(1e-4f));
        EXPECT_NEAR(rotation.determinant(), 1, 1e-4);
      }
      EXPECT_TRUE(local[kPelvis].isIdentity());  // no clips, no turn
    }
  }
}

// The knee only hinges: whatever the mix, the shin never swings in front of the thigh's line.
TEST(PoseSampler, KneesNeverBendForward) {
  const Points rest = testing::TPoseJoints();
  for (int i = 0; i < 500; ++i) {
    Random random(2, i);
    const auto local = SamplePose(random, PoseMix::kHard, MotionLibrary({}), Split::kTrain, rest);
    for (const int knee : {kLeftKnee, kRightKnee}) {
      EXPECT_LT((local[knee] * Eigen::Vector3f(0, -1, 0)).z(), 0.05f) << i;
    }
  }
}

TEST(PoseSampler, HardPosesBendMoreThanModerateOnes) {
  const Points rest = testing::TPoseJoints();
  const auto mean_angle = [&rest](PoseMix mix) {
    double sum = 0;
    for (int i = 0; i < 300; ++i) {
      Random random(3, i);
      for (const Rotation& r : SamplePose(random, mix, MotionLibrary({}), Split::kTrain, rest)) {
        sum += std::acos(std::clamp((r.trace() - 1) / 2, -1.0f, 1.0f));
      }
    }
    return sum / 300 / kHumanJoints;
  };
  EXPECT_GT(mean_angle(PoseMix::kHard), 1.3 * mean_angle(PoseMix::kModerate));
}

TEST(PoseSampler, GlobalTurnsCoverTheCircle) {
  int quadrants[4] = {};
  int upright = 0;
  for (int i = 0; i < 1000; ++i) {
    Random random(4, i);
    const Rotation turn = SampleGlobalTurn(random);
    ++quadrants[(turn(0, 2) > 0 ? 1 : 0) + (turn(2, 2) > 0 ? 2 : 0)];
    upright += turn(1, 1) > std::cos(0.8) ? 1 : 0;
  }
  for (const int count : quadrants) EXPECT_NEAR(count, 250, 60);
  EXPECT_GT(upright, 850);
  EXPECT_LT(upright, 1000);  // some tilt far
}

}  // namespace
}  // namespace stance
