#include "core/training/pose_samples.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/training/pose_sampler.h"
#include "core/transfer/anatomical_limits.h"
#include "tests/core/training/small_data.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class PoseSamplesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    data_ = std::make_unique<testing::TemporaryFolder>();
    testing::WriteSmallBody(data_->path() / "body");
    testing::WriteSmallMotions(data_->path() / "motions", 12);
    generator_ = *CharacterGenerator::FromData(data_->path() / "body", data_->path() / "motions");
  }
  static void TearDownTestSuite() {
    generator_.reset();
    data_.reset();
  }

  static inline std::unique_ptr<testing::TemporaryFolder> data_;
  static inline std::unique_ptr<CharacterGenerator> generator_;
};

// Of random numbers: what matters is which goes where.
PoseSample RandomSample() {
  std::srand(3);
  PoseSample sample;
  sample.input.points = Points::Random(20, 3);
  sample.input.normals = Points::Random(20, 3);
  sample.input.normals.rowwise().normalize();
  sample.weights = RowMatrix::Random(20, kHumanJoints).cwiseAbs();
  sample.canonical = Points::Random(20, 3);
  sample.joints = Points::Random(kHumanJoints, 3);
  sample.bones = Points::Random(kHumanJoints, 3);
  for (int j = 0; j < kHumanJoints; ++j) {
    sample.rotations.emplace_back(Eigen::Quaternionf::UnitRandom().toRotationMatrix());
  }
  return sample;
}

TEST(Mirrored, TwiceGivesTheSampleBack) {
  const PoseSample sample = RandomSample(), back = Mirrored(Mirrored(sample));
  EXPECT_EQ(back.input.points, sample.input.points);
  EXPECT_EQ(back.input.normals, sample.input.normals);
  EXPECT_EQ(back.weights, sample.weights);
  EXPECT_EQ(back.canonical, sample.canonical);
  EXPECT_EQ(back.joints, sample.joints);
  EXPECT_EQ(back.bones, sample.bones);
  for (int j = 0; j < kHumanJoints; ++j) EXPECT_EQ(back.rotations[j], sample.rotations[j]);
}

TEST(Mirrored, LeftIsRight) {
  const PoseSample sample = RandomSample(), mirrored = Mirrored(sample);
  EXPECT_EQ(mirrored.weights.col(kLeftKnee), sample.weights.col(kRightKnee));
  EXPECT_EQ(mirrored.joints(kLeftKnee, 0), -sample.joints(kRightKnee, 0));
  EXPECT_EQ(mirrored.joints(kLeftKnee, 1), sample.joints(kRightKnee, 1));
  EXPECT_NEAR(mirrored.rotations[kLeftKnee].determinant(), 1, 1e-5);
}

TEST(Turned, CarriesPlacesAndRotationsAlong) {
  const PoseSample sample = RandomSample();
  const Rotation turn = Eigen::AngleAxisf(1.1f, Eigen::Vector3f(1, 2, 3).normalized()).toRotationMatrix();
  const PoseSample turned = Turned(sample, turn);
  // A place on a limb, in the limb's own frame, is where it was.
  for (int j = 0; j < kHumanJoints; ++j) {
    const Eigen::Vector3f before =
        sample.rotations[j].transpose() * (sample.input.points.row(0) - sample.joints.row(j)).transpose();
    const Eigen::Vector3f after =
        turned.rotations[j].transpose() * (turned.input.points.row(0) - turned.joints.row(j)).transpose();
    EXPECT_LT((before - after).norm(), 1e-5f);
  }
  EXPECT_LT((turned.input.normals - sample.input.normals * turn.transpose()).norm(), 1e-5f);
  EXPECT_EQ(turned.canonical, sample.canonical);
  EXPECT_EQ(turned.weights, sample.weights);
}

// An estimate of the random sample: true but for the weights, which are as they come.
PoseSample SampleWithEstimate() {
  PoseSample sample = RandomSample();
  sample.weights = sample.weights.array().colwise() / sample.weights.rowwise().sum().array();
  sample.bones.row(kPelvis).setZero();
  sample.first = PoseEstimate{sample.weights, sample.canonical, sample.joints,
                              sample.bones,   sample.rotations, Eigen::VectorXf::Ones(kHumanJoints)};
  return sample;
}

TEST(Unposed, ByTheTruthIsTheTruthAtRest) {
  const PoseSample sample = SampleWithEstimate(), unposed = Unposed(sample);
  EXPECT_LT((BoneVectors(HumanSkeleton(), unposed.joints) - sample.bones).cwiseAbs().maxCoeff(), 1e-5f);
  for (const Rotation& rotation : unposed.rotations) {
    EXPECT_LT((rotation - Rotation::Identity()).norm(), 1e-5f);
  }
  EXPECT_EQ(unposed.weights, sample.weights);
  EXPECT_FALSE(unposed.first.has_value());
}

TEST(Unposed, CommutesWithTheMirror) {
  Random random(3);
  PoseSample sample = SampleWithEstimate();
  sample.first = Perturbed(*sample.first, random);
  const PoseSample one = Unposed(Mirrored(sample)), other = Mirrored(Unposed(sample));
  EXPECT_LT((one.input.points - other.input.points).cwiseAbs().maxCoeff(), 1e-5f);
  EXPECT_LT((one.input.normals - other.input.normals).cwiseAbs().maxCoeff(), 1e-5f);
  EXPECT_LT((one.joints - other.joints).cwiseAbs().maxCoeff(), 1e-5f);
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_LT((one.rotations[j] - other.rotations[j]).norm(), 1e-5f);
  }
}

TEST(Perturbed, ALittleAndNeverTheSame) {
  Random random(5);
  const PoseEstimate estimate = *SampleWithEstimate().first;
  const PoseEstimate a = Perturbed(estimate, random), b = Perturbed(estimate, random);
  EXPECT_GT((a.joints - b.joints).norm(), 0);
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_LT((a.joints.row(j) - estimate.joints.row(j)).norm(), 0.04f);
    EXPECT_LT(Eigen::AngleAxisf(estimate.rotations[j].transpose() * a.rotations[j]).angle(), 0.4f);
    EXPECT_NEAR(a.rotations[j].determinant(), 1, 1e-5f);
  }
  EXPECT_EQ(a.weights, estimate.weights);
}

TEST(TrainingTurn, MostStandAndSomeAreUpsideDown) {
  Random random(4);
  int upright = 0, upside_down = 0;
  constexpr int kTurns = 4000;
  for (int i = 0; i < kTurns; ++i) {
    const Rotation turn = TrainingTurn(random);
    ASSERT_NEAR(turn.determinant(), 1, 1e-4f);
    upright += turn(1, 1) > 0.7f;
    upside_down += turn(1, 1) < -0.2f;
  }
  EXPECT_GT(upright, 0.7 * kTurns);
  EXPECT_GT(upside_down, 0.04 * kTurns);
  EXPECT_LT(upside_down, 0.09 * kTurns);
}

TEST_F(PoseSamplesTest, BatchesHoldTheTruth) {
  const SampleOptions options{5, 96, 12};
  PoseStream stream(*generator_, options, 1);
  const PoseBatch batch = stream.MakeBatch(3, 4);
  EXPECT_EQ(batch.weights.sizes(), (std::vector<int64_t>{4 * 96, 24}));
  EXPECT_LT((batch.weights.sum(1) - 1).abs().max().item<float>(), 1e-4f);
  EXPECT_LE(batch.canonical.abs().max().item<float>(), 1.0f);
  const auto identity = torch::matmul(batch.rotations, batch.rotations.transpose(2, 3)) - torch::eye(3);
  EXPECT_LT(identity.abs().max().item<float>(), 1e-4f);
}

// What the network that refines should find, put back into the characters' poses, is the truth about them.
TEST_F(PoseSamplesTest, UnposedBatchesKnowTheWayBack) {
  const auto model = PoseModel::Load(testing::UntrainedModel(96, 2, kStanceMethod).dir());
  ASSERT_TRUE(model.ok()) << model.status();
  PoseStream stream(*generator_, {5, 96, 12}, 2, model->get());
  const PoseBatch batch = stream.MakeBatch(3, 4);
  ASSERT_TRUE(batch.posed.has_value());
  const PosedBatch& posed = *batch.posed;
  const auto joints = torch::matmul(posed.turns, batch.joints.unsqueeze(-1)).squeeze(-1) + posed.shifts;
  EXPECT_LT((joints - posed.joints).abs().max().item<float>(), 1e-4f);
  const auto rotations = torch::matmul(posed.turns, batch.rotations);
  EXPECT_LT((rotations - posed.rotations).abs().max().item<float>(), 1e-4f);
  EXPECT_EQ(posed.points.sizes(), batch.input.points.sizes());
}

TEST_F(PoseSamplesTest, AStreamGivesTheSameBatchesInAnyOrder) {
  const SampleOptions options{5, 96, 12};
  PoseStream forward(*generator_, options, 3), backward(*generator_, options, 3);
  const PoseBatch early = forward.MakeBatch(0, 6), late = forward.MakeBatch(6, 6);
  const PoseBatch late_first = backward.MakeBatch(6, 6), early_last = backward.MakeBatch(0, 6);
  EXPECT_TRUE(early.input.points.equal(early_last.input.points));
  EXPECT_TRUE(late.input.points.equal(late_first.input.points));
  EXPECT_TRUE(late.rotations.equal(late_first.rotations));
}

TEST_F(PoseSamplesTest, ReuseGivesTheSameCharactersTurnedAnew) {
  const SampleOptions options{5, 96, 12};
  PoseStream stream(*generator_, options, 2);
  // The second sample is the first's character: there is no other yet. Its canonical places, mirrored or not,
  // and the spread of its points about their centre are the same.
  const PoseBatch batch = stream.MakeBatch(0, 2);
  const auto canonical = batch.canonical.reshape({2, 96, 3}).abs();
  EXPECT_TRUE(canonical[0].equal(canonical[1]));
  EXPECT_FALSE(batch.rotations[0].equal(batch.rotations[1]));
}

// The limits that the pose solver keeps are wider than the generator's. (The small data's clips turn every
// joint at random; the hinges of the captured ones are within the limits, too.)
TEST(PoseSampler, StaysWithinTheSolversLimits) {
  for (const PoseMix mix : {PoseMix::kModerate, PoseMix::kHard, PoseMix::kTraining}) {
    for (int64_t i = 0; i < 500; ++i) {
      Random random(7, i);
      const std::vector<Rotation> truth = GlobalRotations(
          HumanSkeleton(), SamplePose(random, mix, MotionLibrary({}), Split::kTrain, testing::TPoseJoints()));
      const std::vector<Rotation> limited = WithinAnatomicalLimits(truth);
      for (int j = 0; j < kHumanJoints; ++j) {
        EXPECT_LT(Eigen::AngleAxisf(truth[j].transpose() * limited[j]).angle(), 0.0175f) << i << " " << j;
      }
    }
  }
}

}  // namespace
}  // namespace stance
