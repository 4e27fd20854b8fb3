#include "core/training/evaluation_bones.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "tests/core/training/evaluation_fixture.h"
#include "tests/core/training/stick_character.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::vector<int>& Parents() { return HumanSkeleton().parents(); }

// The stick figure's joints, each moved by up to `metres`.
std::vector<Points> Shaken(int poses, double metres, uint64_t seed) {
  Random random(seed);
  std::vector<Points> joints(static_cast<size_t>(poses), testing::StickCharacter().joints);
  for (Points& pose : joints) {
    for (float& value : pose.reshaped()) value += static_cast<float>(random.Uniform(-metres, metres));
  }
  return joints;
}

TEST(CompareBones, OfIdenticalSkeletonsIsZero) {
  const std::vector<Points> same(5, testing::StickCharacter().joints);
  const std::vector<BoneErrors> bones = CompareBones(same, same, Parents());
  ASSERT_EQ(bones.size(), static_cast<size_t>(kHumanJoints - 1));
  for (const BoneErrors& bone : bones) {
    EXPECT_GT(bone.length_mm, 10);
    EXPECT_EQ(bone.true_mm, bone.length_mm);
    EXPECT_NEAR(bone.deviation_mm, 0, 1e-9);
    EXPECT_NEAR(bone.variation, 0, 1e-12);
    EXPECT_EQ(bone.error_mm, 0);
  }
}

// Wherever a pose's joints lie as a whole.
TEST(CompareBones, DoesNotSeeRigidMotions) {
  const std::vector<Points> still(3, testing::StickCharacter().joints);
  std::vector<Points> moved = still;
  const Eigen::RowVector3f by(0.3f, -2, 1);
  moved[1] = (still[1].rowwise() + by).eval();
  moved[2] = (still[2] * Eigen::AngleAxisf(1, Eigen::Vector3f::UnitX()).toRotationMatrix()).eval();
  for (const BoneErrors& bone : CompareBones(moved, still, Parents())) {
    EXPECT_NEAR(bone.deviation_mm, 0, 1e-3);
    EXPECT_NEAR(bone.error_mm, 0, 1e-3);
  }
}

TEST(CompareBones, ScalingScalesLengthsAndLeavesTheVariation) {
  const std::vector<Points> predicted = Shaken(6, 0.02, 1), truth = Shaken(6, 0, 2);
  std::vector<Points> predicted3 = predicted, truth3 = truth;
  for (Points& pose : predicted3) pose *= 3;
  for (Points& pose : truth3) pose *= 3;
  const auto one = CompareBones(predicted, truth, Parents()),
             three = CompareBones(predicted3, truth3, Parents());
  for (size_t b = 0; b < one.size(); ++b) {
    EXPECT_GT(one[b].deviation_mm, 0);
    EXPECT_NEAR(three[b].length_mm, 3 * one[b].length_mm, 1e-3);
    EXPECT_NEAR(three[b].true_mm, 3 * one[b].true_mm, 1e-3);
    EXPECT_NEAR(three[b].deviation_mm, 3 * one[b].deviation_mm, 1e-3);
    EXPECT_NEAR(three[b].error_mm, 3 * one[b].error_mm, 1e-3);
    EXPECT_NEAR(three[b].variation, one[b].variation, 1e-6);
  }
}

// Lengths 100, 200 and 300 mm against 200: the deviation is sqrt(20000 / 3), the error 200 / 3.
TEST(CompareBones, HandComputed) {
  const auto bone_of = [](float length) {
    Points joints = Points::Zero(2, 3);
    joints(1, 1) = length;
    return joints;
  };
  const std::vector<BoneErrors> bones = CompareBones({bone_of(0.1f), bone_of(0.2f), bone_of(0.3f)},
                                                     std::vector<Points>(3, bone_of(0.2f)), {-1, 0});
  ASSERT_EQ(bones.size(), 1u);
  EXPECT_NEAR(bones[0].length_mm, 200, 1e-4);
  EXPECT_NEAR(bones[0].true_mm, 200, 1e-4);
  EXPECT_NEAR(bones[0].deviation_mm, std::sqrt(20000.0 / 3), 1e-4);
  EXPECT_NEAR(bones[0].variation, std::sqrt(20000.0 / 3) / 200, 1e-6);
  EXPECT_NEAR(bones[0].error_mm, 200.0 / 3, 1e-4);
  EXPECT_THAT(CompareBones({}, {}, {-1, 0}), IsEmpty());
}

TEST(MeanBones, OfEqualOnesIsThat) {
  const auto bones = CompareBones(Shaken(4, 0.02, 3), Shaken(4, 0, 3), Parents());
  const auto mean = MeanBones({bones, bones});
  ASSERT_EQ(mean.size(), bones.size());
  for (size_t b = 0; b < mean.size(); ++b) {
    EXPECT_DOUBLE_EQ(mean[b].deviation_mm, bones[b].deviation_mm);
    EXPECT_DOUBLE_EQ(mean[b].error_mm, bones[b].error_mm);
  }
  EXPECT_THAT(MeanBones({}), IsEmpty());
}

// The real generator and pipeline; what untrained networks answer is bad but the same every time.
TEST(EvaluateBones, MeasuresEveryIdentityOnAnyNumberOfThreads) {
  BoneEvaluationOptions options{.identities = 3, .poses_each = 2};
  int last = 0;
  const BoneEvaluation one = EvaluateBones(testing::SmallGenerator(), testing::UntrainedPipeline(), options,
                                           [&](int done) { last = done; });
  EXPECT_EQ(last, 3);
  EXPECT_EQ(one.poses, 6);
  EXPECT_THAT(one.failures, IsEmpty());
  ASSERT_EQ(one.bones.size(), static_cast<size_t>(kHumanJoints - 1));
  EXPECT_GT(one.overall.deviation_mm, 0);
  EXPECT_GT(one.overall.error_mm, 0);
  // Both are means over identities and bones.
  EXPECT_NEAR(one.table.mean_length * 1000, one.overall.length_mm, 1e-3);
  EXPECT_NEAR(one.table.mean_deviation * 1000, one.overall.deviation_mm, 1e-3);
  EXPECT_GE(one.table.max_deviation, one.table.mean_deviation);
  options.threads = 3;
  const BoneEvaluation three =
      EvaluateBones(testing::SmallGenerator(), testing::UntrainedPipeline(), options);
  EXPECT_EQ(BonesCsv("", "", three, HumanSkeleton()), BonesCsv("", "", one, HumanSkeleton()));
}

TEST(EvaluateBones, RefusedMeshesAreListed) {
  BoneEvaluationOptions options{.identities = 1, .poses_each = 2};
  options.transfer.limits.max_vertices = 10;
  const BoneEvaluation bones =
      EvaluateBones(testing::SmallGenerator(), testing::UntrainedPipeline(), options);
  EXPECT_EQ(bones.poses, 0);
  EXPECT_EQ(bones.overall.length_mm, 0);
  EXPECT_EQ(bones.failures.size(), 2u);
  EXPECT_THAT(bones.failures[0], HasSubstr("identity 0: INVALID_ARGUMENT"));
}

TEST(BonesTables, ARowPastesBelowAnother) {
  BoneEvaluation bones;
  bones.poses = 40;
  bones.bones.assign(kHumanJoints - 1, BoneErrors{});
  bones.bones[kLeftKnee - 1] = {400, 410, 5, 0.0125, 11};
  bones.overall = {200, 201, 4, 0.02, 6};
  bones.table = {.mean_length = 0.2, .max_deviation = 0.012, .mean_deviation = 0.004};
  const std::string header = BonesHeader(), row = BonesRow("mine", bones);
  EXPECT_EQ(row, "| mine | 0.2000 | 0.0120 | 0.0040 | 40 | 201.0 | 4.0 | 2.0 | 6.0 |\n");
  const auto columns = [](const std::string& line) { return std::count(line.begin(), line.end(), '|'); };
  EXPECT_EQ(columns(row), columns(header.substr(0, header.find('\n'))));
  EXPECT_EQ(columns(header), 3 * columns(row));
  EXPECT_THAT(BonesMarkdown(bones, HumanSkeleton()),
              HasSubstr("| left_hip to left_knee | 400.0 | 410.0 | 5.0 | 1.2 | 11.0 |"));
  const std::string csv = BonesCsv("stance", "hard", bones, HumanSkeleton());
  EXPECT_THAT(csv, HasSubstr("stance,hard,left_hip to left_knee,400,410,5,0.0125,11\n"));
  EXPECT_THAT(csv, HasSubstr("stance,hard,all,200,201,4,0.02,6\nstance,hard,table1_max,,,12,,\n"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), kHumanJoints + 1);
}

}  // namespace
}  // namespace stance
