#include "core/training/limb_style.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/skeleton/skeleton.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

std::vector<Rotation> RandomRotations(uint64_t seed) {
  Random random(seed);
  std::vector<Rotation> global(kHumanJoints);
  for (Rotation& rotation : global) {
    const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
    rotation = Eigen::AngleAxisd(random.Uniform(0, 2), axis.normalized()).toRotationMatrix().cast<float>();
  }
  return global;
}

TEST(LimbStyle, ScalesArePositiveAndAlikeOnBothSides) {
  for (int i = 0; i < 50; ++i) {
    Random random(1, i);
    const LimbScales scales = SampleLimbScales(random);
    for (int j = 0; j < kHumanJoints; ++j) {
      EXPECT_GT(scales[j].minCoeff(), 0);
      EXPECT_TRUE(scales[j].isApprox(scales[MirrorJoint(j)]));
    }
  }
}

TEST(LimbStyle, UnitScalesAreThePlainTransforms) {
  const Points joints = testing::SmallBodyJoints();
  const std::vector<Rotation> global = RandomRotations(2);
  const auto plain = PoseTransforms(HumanSkeleton(), joints, global);
  const auto scaled = ScaledPoseTransforms(joints, global, LimbScales(kHumanJoints, Eigen::Vector3f::Ones()));
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_TRUE(plain[j].linear.isApprox(scaled[j].linear, 1e-5f));
    EXPECT_LT((plain[j].translation - scaled[j].translation).norm(), 1e-5f);
  }
}

TEST(LimbStyle, BonesHangTogether) {
  const Points joints = testing::SmallBodyJoints();
  Random random(3);
  const auto transforms = ScaledPoseTransforms(joints, RandomRotations(3), SampleLimbScales(random));
  for (int j = 1; j < kHumanJoints; ++j) {
    const Eigen::Vector3f joint = joints.row(j).transpose();
    EXPECT_LT((transforms[j].Apply(joint) - transforms[HumanSkeleton().parents()[j]].Apply(joint)).norm(),
              1e-5f);
  }
}

}  // namespace
}  // namespace stance
