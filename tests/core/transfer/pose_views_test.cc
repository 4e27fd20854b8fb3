#include "core/transfer/pose_views.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>

namespace stance {
namespace {

PoseEstimate RandomEstimate() {
  std::srand(5);
  PoseEstimate estimate;
  estimate.weights = RowMatrix::Random(20, kHumanJoints).cwiseAbs();
  estimate.canonical = Points::Random(20, 3);
  estimate.joints = Points::Random(kHumanJoints, 3);
  estimate.bones = Points::Random(kHumanJoints, 3);
  estimate.confidence = Eigen::VectorXf::Random(kHumanJoints).cwiseAbs();
  for (int j = 0; j < kHumanJoints; ++j) {
    estimate.rotations.emplace_back(Eigen::Quaternionf::UnitRandom().toRotationMatrix());
  }
  return estimate;
}

TEST(EvenViews, HalfAreMirrored) {
  const std::vector<PoseView> views = EvenViews(8);
  ASSERT_EQ(views.size(), 8u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_FALSE(views[i].mirrored);
    EXPECT_TRUE(views[i + 4].mirrored);
    EXPECT_EQ(views[i].turn, views[i + 4].turn);
    EXPECT_NEAR(views[i].turn(1, 1), 1, 1e-6f);  // about y
  }
  EXPECT_EQ(EvenViews(1).size(), 1u);
  EXPECT_EQ(EvenViews(1)[0].turn, Rotation::Identity());
}

TEST(OtherSides, BringAnyUpAxisNearTheTop) {
  std::srand(2);
  std::vector<PoseView> sides = OtherSides();
  EXPECT_EQ(sides.size(), 5u);
  sides.push_back({});
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3f up = Eigen::Vector3f::Random().normalized();
    float highest = -1;
    for (const PoseView& side : sides) highest = std::max(highest, (side.turn * up).y());
    EXPECT_GT(highest, std::sqrt(1 / 3.0f) - 1e-4f) << up.transpose();
  }
}

// A joint that lies on a sample in the view lies on it behind the view.
TEST(EstimateBehindView, PlacesReturnToTheInputs) {
  std::srand(6);
  PyramidInput input;
  input.points = Points::Random(kHumanJoints, 3);
  input.normals = Points::Random(kHumanJoints, 3);
  std::vector<PoseView> views = EvenViews(8);
  for (const PoseView& side : OtherSides()) views.push_back(side);
  for (const PoseView& view : views) {
    PoseEstimate estimate = RandomEstimate();
    const Points seen = ViewedInput(input, view).points;
    for (int j = 0; j < kHumanJoints; ++j) {
      estimate.joints.row(view.mirrored ? MirrorJoint(j) : j) = seen.row(j);
    }
    const PoseEstimate behind = EstimateBehindView(estimate, view);
    EXPECT_LT((behind.joints - input.points).cwiseAbs().maxCoeff(), 1e-5f);
    for (const Rotation& rotation : behind.rotations) EXPECT_NEAR(rotation.determinant(), 1, 1e-4f);
  }
}

TEST(EstimateBehindView, AMirrorSwapsLeftAndRight) {
  const PoseEstimate seen = RandomEstimate(), behind = EstimateBehindView(seen, {.mirrored = true});
  EXPECT_EQ(behind.weights.col(kLeftKnee), seen.weights.col(kRightKnee));
  EXPECT_EQ(behind.confidence[kLeftKnee], seen.confidence[kRightKnee]);
  EXPECT_EQ(behind.bones(kLeftKnee, 0), -seen.bones(kRightKnee, 0));
  const PoseEstimate twice = EstimateBehindView(behind, {.mirrored = true});
  EXPECT_EQ(twice.joints, seen.joints);
  EXPECT_EQ(twice.canonical, seen.canonical);
}

TEST(MeanEstimate, OfEqualOnesIsThat) {
  const std::vector<PoseEstimate> same(4, RandomEstimate());
  const PoseEstimate mean = MeanEstimate(same);
  EXPECT_LT((mean.weights - same[0].weights).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_LT((mean.bones - same[0].bones).cwiseAbs().maxCoeff(), 1e-6f);
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_LT((mean.rotations[j] - same[0].rotations[j]).cwiseAbs().maxCoeff(), 1e-5f);
  }
}

}  // namespace
}  // namespace stance
