#include "core/training/joint_limits.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

TEST(JointLimits, RangesHoldTheRestPose) {
  for (int j = 0; j < kHumanJoints; ++j) {
    for (const AngleRange& range : JointRange(j)) {
      EXPECT_LE(range.low, 0);
      EXPECT_GE(range.high, 0);
    }
    EXPECT_TRUE(JointRotation(j, {}).isIdentity());
  }
}

TEST(JointLimits, EqualAnglesMirrorAcrossTheBody) {
  const Eigen::Matrix3f flip = Eigen::Vector3f(-1, 1, 1).asDiagonal();
  for (int j = 1; j < kHumanJoints; ++j) {
    if (MirrorJoint(j) == j) continue;
    const EulerAngles angles{12, -34, 56};
    EXPECT_TRUE(
        JointRotation(MirrorJoint(j), angles).isApprox(flip * JointRotation(j, angles) * flip, 1e-5f));
  }
}

// The body faces +z, y is up: what each sign of a bend does to the limb below.
TEST(JointLimits, LimbsBendTheAnatomicalWay) {
  const Eigen::Vector3f down(0, -1, 0);
  for (const int side : {0, 1}) {
    const Eigen::Vector3f outward(side == 0 ? 1.0f : -1.0f, 0, 0);
    EXPECT_LT((JointRotation(kLeftKnee + side, {90, 0, 0}) * down).z(), -0.9f);          // the heel goes back
    EXPECT_GT((JointRotation(kLeftHip + side, {-90, 0, 0}) * down).z(), 0.9f);           // the knee comes up
    EXPECT_GT((JointRotation(kLeftHip + side, {0, 0, 30}) * down).dot(outward), 0.4f);   // the leg spreads
    EXPECT_LT((JointRotation(kLeftShoulder + side, {0, 0, -80}) * outward).y(), -0.9f);  // the arm hangs
    EXPECT_GT((JointRotation(kLeftElbow + side, {0, -90, 0}) * outward).z(), 0.9f);  // the hand comes forward
  }
  EXPECT_GT(JointRange(kLeftKnee)[0].high, 90);
  EXPECT_EQ(JointRange(kLeftKnee)[0].low, 0);
  EXPECT_LT(JointRange(kRightElbow)[1].low, -90);
}

}  // namespace
}  // namespace stance
