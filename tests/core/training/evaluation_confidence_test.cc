#include "core/training/evaluation_confidence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "tests/core/training/evaluation_fixture.h"
#include "tests/core/training/stick_character.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

// What a perfect rigger would have answered.
Rig TruthAsRig(const Character& truth) {
  Rig rig;
  rig.joints = truth.joints;
  rig.rotations = truth.rotations;
  return rig;
}

Rotation Turned(double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d(1, 2, 2).normalized())
      .toRotationMatrix()
      .cast<float>();
}

TEST(RightJoints, AreThoseNearInPlaceAndRotation) {
  const Character truth = testing::StickCharacter();
  EXPECT_EQ(RightJoints(TruthAsRig(truth), truth), Eigen::VectorXf::Ones(kHumanJoints));
  Rig rig = TruthAsRig(truth);
  rig.joints(kLeftKnee, 2) += 0.029f;
  rig.joints(kHead, 0) += 0.031f;
  rig.rotations[kNeck] = Turned(14.9);
  rig.rotations[kRightHip] = Turned(-15.1);
  rig.rotations[kLeftHand] = Turned(180);
  Eigen::VectorXf right = Eigen::VectorXf::Ones(kHumanJoints);
  right[kHead] = right[kRightHip] = right[kLeftHand] = 0;
  EXPECT_EQ(RightJoints(rig, truth), right);
}

// A character of another size, in another unit.
TEST(RightJoints, CountDistancesInStatures) {
  Character truth = testing::StickCharacter();
  truth.joints *= 100;
  truth.stature *= 100;
  Rig rig = TruthAsRig(truth);
  rig.joints(kLeftKnee, 2) += 2.9f;
  rig.joints(kHead, 0) += 3.1f;
  const Eigen::VectorXf right = RightJoints(rig, truth);
  EXPECT_EQ(right[kLeftKnee], 1);
  EXPECT_EQ(right[kHead], 0);
}

// Moves `share` of the surface by joint 0 and the rest by joint 1, both stated with `confidence`.
ConfidenceObservation Observation(float share, float confidence, bool right0, bool right1, double mean_mm) {
  ConfidenceObservation one{.poses = "hard", .mean_mm = mean_mm};
  one.shares = Eigen::VectorXf::Zero(kHumanJoints);
  one.shares[0] = share;
  one.shares[1] = 1 - share;
  one.confidence.fill(Eigen::VectorXf::Constant(kHumanJoints, confidence));
  one.right.fill(Eigen::VectorXf::Ones(kHumanJoints));
  one.right[0][0] = right0 ? 1.0f : 0.0f;
  one.right[1][1] = right1 ? 1.0f : 0.0f;
  return one;
}

TEST(Claims, OneOfEachJointOfEachMeshAndOneOfEachTransfer) {
  std::vector<ConfidenceObservation> observations = {Observation(0.75f, 0.5f, true, false, 10),
                                                     Observation(0.75f, 0.5f, false, true, 30)};
  observations.push_back({.poses = "hard", .failure = "INTERNAL: no"});
  EXPECT_EQ(JointClaims(observations).size(), 2u * 2u * kHumanJoints);
  const std::vector<Claim> pelvis = JointClaims(observations, 0);
  ASSERT_EQ(pelvis.size(), 4u);
  EXPECT_EQ(pelvis[0].outcome, 1);
  EXPECT_EQ(pelvis[2].outcome, 0);
  const std::vector<Claim> transfers = TransferClaims(observations);
  ASSERT_EQ(transfers.size(), 2u);
  EXPECT_NEAR(transfers[0].probability, 0.25, 1e-6);  // both right
  EXPECT_NEAR(transfers[0].outcome, 0.75, 1e-6);
  EXPECT_NEAR(transfers[1].outcome, 0.25, 1e-6);
  // Joint by joint: a bias of log 3 makes 3/4 of 1/2.
  EXPECT_NEAR(TransferClaims(observations, {.scale = 1, .bias = std::log(3)})[0].probability, 9.0 / 16, 1e-6);
}

TEST(KeptAbove, KeepsTheSurerTransfers) {
  std::vector<ConfidenceObservation> observations;
  for (int i = 0; i < 4; ++i) {  // confidences 0.16, 0.36, 0.64, 1; errors 40, 30, 20, 10 mm
    observations.push_back(Observation(0.5f, std::array{0.4f, 0.6f, 0.8f, 1.0f}[static_cast<size_t>(i)], true,
                                       true, 40 - 10 * i));
  }
  observations.push_back({.poses = "hard", .failure = "INTERNAL: no"});
  const std::vector<KeptTransfers> table = KeptAbove(observations, {0, 0.3, 0.5, 0.9});
  ASSERT_EQ(table.size(), 4u);
  EXPECT_EQ(table[0].share, 1);
  EXPECT_DOUBLE_EQ(table[0].mean_mm, 25);
  EXPECT_EQ(table[0].worst_mm, 40);
  EXPECT_EQ(table[2].share, 0.5);
  EXPECT_DOUBLE_EQ(table[2].mean_mm, 15);
  EXPECT_DOUBLE_EQ(table[2].p95_mm, 19.5);
  for (size_t i = 1; i < table.size(); ++i) EXPECT_LE(table[i].share, table[i - 1].share);
  EXPECT_EQ(KeptAbove(observations, {1.1})[0].share, 0);
  EXPECT_EQ(KeptAbove({}, {0})[0].share, 0);
}

const Pipeline& UntrainedStance() {
  static const std::unique_ptr<Pipeline> kPipeline = [] {
    const testing::UntrainedModel model(128, 2, "stance");
    return *Pipeline::Load(model.dir());
  }();
  return *kPipeline;
}

// The real generator and pipeline; what an untrained network answers is bad but the same every time.
TEST(ObserveConfidence, ObservesEveryPairOnAnyNumberOfThreads) {
  ConfidenceEvaluationOptions options{.pairs = 2};
  int last = 0;
  const auto one = ObserveConfidence(testing::SmallGenerator(), UntrainedStance(), options,
                                     [&](int done) { last = done; });
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_EQ(last, 4);
  ASSERT_EQ(one->size(), 4u);
  options.threads = 3;
  const auto three = ObserveConfidence(testing::SmallGenerator(), UntrainedStance(), options);
  ASSERT_TRUE(three.ok());
  for (size_t i = 0; i < one->size(); ++i) {
    const ConfidenceObservation& observation = (*one)[i];
    EXPECT_EQ(observation.poses, i < 2 ? "moderate" : "hard");
    EXPECT_EQ(observation.index, static_cast<int64_t>(i % 2));
    EXPECT_EQ(observation.failure, "");
    EXPECT_GT(observation.mean_mm, 0);
    EXPECT_NEAR(observation.shares.sum(), 1, 1e-5f);
    EXPECT_EQ(observation.confidence[0].size(), kHumanJoints);
    EXPECT_EQ((*three)[i].confidence[1], observation.confidence[1]);
    EXPECT_EQ((*three)[i].right[1], observation.right[1]);
  }
}

TEST(ObserveConfidence, RefusedTransfersAreFailures) {
  ConfidenceEvaluationOptions options{.pairs = 1, .poses = {PoseMix::kHard}};
  options.transfer.limits.max_vertices = 10;
  const auto observations = ObserveConfidence(testing::SmallGenerator(), UntrainedStance(), options);
  ASSERT_TRUE(observations.ok());
  EXPECT_THAT((*observations)[0].failure, HasSubstr("INVALID_ARGUMENT"));
}

TEST(ObserveConfidence, NeedsAMethodThatKnowsItsConfidence) {
  const absl::Status status =
      ObserveConfidence(testing::SmallGenerator(), testing::UntrainedPipeline(), {.pairs = 1}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("method: 'skeletal'"));
}

}  // namespace
}  // namespace stance
