#include "core/training/evaluation_stages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/core/training/evaluation_fixture.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

TEST(CompareWeights, TheTruthItselfIsPerfect) {
  const RowMatrix weights{{0.7f, 0.3f}, {0, 1}};
  const WeightErrors errors = CompareWeights(weights, weights);
  EXPECT_EQ(errors.accuracy, 1);
  EXPECT_EQ(errors.l1, 0);
}

// Vertex 0: the same largest weight, |0.6 - 0.8| + |0.4 - 0.2| = 0.4. Vertex 1: another largest weight, 2.
// Vertex 2: equal. Vertex 3: the same largest weight, |1 - 0.5| + |0 - 0.5| = 1 (the first of equals counts).
TEST(CompareWeights, HandComputed) {
  const RowMatrix truth{{0.8f, 0.2f}, {1, 0}, {0, 1}, {0.5f, 0.5f}};
  const RowMatrix predicted{{0.6f, 0.4f}, {0, 1}, {0, 1}, {1, 0}};
  const WeightErrors errors = CompareWeights(predicted, truth);
  EXPECT_DOUBLE_EQ(errors.accuracy, 0.75);
  EXPECT_NEAR(errors.l1, (0.4 + 2 + 0 + 1) / 4, 1e-6);
}

// The real generator and pipeline; what untrained networks answer is bad but the same every time.
TEST(EvaluateStages, MeasuresEveryCharacterOnAnyNumberOfThreads) {
  StageEvaluationOptions options;
  options.characters = 4;
  options.identities = 2;
  options.poses_each = 3;
  int last = 0;
  const StageErrors one = EvaluateStages(testing::SmallGenerator(), testing::UntrainedPipeline(), options,
                                         [&](int done) { last = done; });
  EXPECT_EQ(last, 4);
  EXPECT_EQ(one.characters, 4);
  EXPECT_THAT(one.failures, ::testing::IsEmpty());
  EXPECT_LT(one.rigid.accuracy, 1);
  EXPECT_GT(one.rigid.l1, 0);
  EXPECT_LE(one.rigid.l1, 2);
  EXPECT_LE(one.smooth.l1, 2);
  ASSERT_EQ(one.joint_mm.size(), static_cast<size_t>(kHumanJoints));
  EXPECT_GT(*std::min_element(one.joint_mm.begin(), one.joint_mm.end()), 0);
  EXPECT_GT(one.bones.max_deviation, 0);
  EXPECT_GE(one.bones.max_deviation, one.bones.mean_deviation);
  options.threads = 3;
  const StageErrors three = EvaluateStages(testing::SmallGenerator(), testing::UntrainedPipeline(), options);
  EXPECT_EQ(StagesCsv(three, HumanSkeleton(), ""), StagesCsv(one, HumanSkeleton(), ""));
}

TEST(EvaluateStages, RefusedCharactersAreListed) {
  StageEvaluationOptions options;
  options.characters = 2;
  options.identities = 0;
  options.transfer.limits.max_vertices = 10;
  const StageErrors errors = EvaluateStages(testing::SmallGenerator(), testing::UntrainedPipeline(), options);
  EXPECT_EQ(errors.characters, 0);
  EXPECT_EQ(errors.mean_joint_mm, 0);
  EXPECT_THAT(errors.failures, ::testing::ElementsAre(HasSubstr("character 0: INVALID_ARGUMENT"),
                                                      HasSubstr("character 1: INVALID_ARGUMENT")));
}

TEST(StagesTables, NameEachJointAndFailure) {
  StageErrors errors;
  errors.characters = 3;
  errors.rigid = {.accuracy = 0.91, .l1 = 0.2};
  errors.joint_mm.assign(kHumanJoints, 0.0);
  errors.joint_mm[kLeftKnee] = 12.5;
  errors.failures = {"character 7: INTERNAL: no"};
  const std::string markdown = StagesMarkdown(errors, HumanSkeleton());
  EXPECT_THAT(markdown, HasSubstr("| weight accuracy (largest weight), rigid | 91.00 % |"));
  EXPECT_THAT(markdown, HasSubstr("| left_knee | 12.5 |"));
  EXPECT_THAT(markdown, HasSubstr("- character 7: INTERNAL: no"));
  const std::string csv = StagesCsv(errors, HumanSkeleton(), "hard");
  EXPECT_THAT(csv, HasSubstr("hard,rigid_accuracy,0.91\n"));
  EXPECT_THAT(csv, HasSubstr("hard,joint_mm_left_knee,12.5\n"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 9 + kHumanJoints);
}

}  // namespace
}  // namespace stance
