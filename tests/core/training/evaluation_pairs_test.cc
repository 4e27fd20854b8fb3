#include "core/training/evaluation_pairs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/base/random.h"
#include "tests/core/training/evaluation_fixture.h"
#include "tests/core/training/stick_character.h"

namespace stance {
namespace {

using testing::Posed;
using testing::StickCharacter;

constexpr char kUnchanged[] = "source left as it is";
constexpr char kMethodTrueRotations[] = "method with true rotations";
constexpr char kPaper[] = "true weights and joints, paper A's rotations";
constexpr char kInherited[] = "true weights and joints, inherited twist";
constexpr char kAllTrue[] = "true weights, joints and rotations";

std::vector<Rotation> RandomPose(uint64_t seed) {
  Random random(seed);
  std::vector<Rotation> local(kHumanJoints);
  for (Rotation& rotation : local) {
    const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
    rotation = Eigen::AngleAxisd(random.Normal(0, 0.5), axis.normalized()).toRotationMatrix().cast<float>();
  }
  return GlobalRotations(HumanSkeleton(), local);
}

std::vector<Rotation> WholeTurn(float yaw) {
  return std::vector<Rotation>(kHumanJoints,
                               Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitY()).toRotationMatrix());
}

TransferPair PairOfPoses(const std::vector<Rotation>& source, const std::vector<Rotation>& reference) {
  const Character rest = StickCharacter();
  TransferPair pair{Posed(rest, source), Posed(rest, reference), {}};
  pair.truth = pair.reference.mesh.positions;  // the same identity, and the pelvis stays where it is
  return pair;
}

// What a perfect method would have answered.
TransferResult TruthAsResult(const TransferPair& pair) {
  TransferResult result;
  result.source_rig = {pair.source.joints, pair.source.weights};
  return result;
}

// Mean vertex error of the named composition, millimetres.
double MeanError(const TransferPair& pair, const std::string& method) {
  const TransferResult result = TruthAsResult(pair);
  for (const Candidate& candidate : ComposeParts(pair, &result)) {
    if (candidate.method == method) {
      return Judge("p", candidate, pair.truth, pair.source.mesh.faces, pair.source.stature).errors.mean_mm;
    }
  }
  ADD_FAILURE() << "no row " << method;
  return -1;
}

TEST(ComposeParts, EqualPosesAreZeroForEveryComposition) {
  const TransferPair pair = PairOfPoses(RandomPose(1), RandomPose(1));
  EXPECT_EQ(MeanError(pair, kUnchanged), 0);
  for (const char* method : {kMethodTrueRotations, kPaper, kInherited, kAllTrue}) {
    EXPECT_NEAR(MeanError(pair, method), 0, 1e-2) << method;
  }
}

// With rigid weights, un-posing by the inverse rotation is exact: the truth's own parts reach the truth.
TEST(ComposeParts, TrueRotationsReachTheTruthOfARigidCharacter) {
  for (const uint64_t seed : {1, 2, 3}) {
    const TransferPair pair = PairOfPoses(RandomPose(seed), RandomPose(seed + 100));
    EXPECT_NEAR(MeanError(pair, kAllTrue), 0, 1e-2);
    EXPECT_NEAR(MeanError(pair, kMethodTrueRotations), 0, 1e-2);
    EXPECT_GT(MeanError(pair, kUnchanged), 50);
    EXPECT_GT(MeanError(pair, kPaper), 1);  // bone directions don't show the twist
  }
}

// The three bones out of pelvis and chest fix their rotations exactly; a limb's twist is lost by the smallest
// rotation and kept by inheriting it.
TEST(ComposeParts, AWholeTurnIsRecoveredByInheritedTwist) {
  const TransferPair pair = PairOfPoses(WholeTurn(0), WholeTurn(1.0f));
  EXPECT_NEAR(MeanError(pair, kInherited), 0, 0.05);
  EXPECT_GT(MeanError(pair, kPaper), 1);
}

TEST(ComposeParts, EveryPairHasTheSameRowsEvenWhenTheMethodFailed) {
  const TransferPair pair = PairOfPoses(RandomPose(1), RandomPose(2));
  const TransferResult result = TruthAsResult(pair);
  const std::vector<Candidate> with = ComposeParts(pair, &result), without = ComposeParts(pair, nullptr);
  ASSERT_EQ(with.size(), without.size());
  for (size_t i = 0; i < with.size(); ++i) {
    EXPECT_EQ(with[i].method, without[i].method);
    EXPECT_TRUE(with[i].positions.ok());
    EXPECT_EQ(without[i].positions.ok(), without[i].method != kMethodTrueRotations);
  }
}

// The real generator and pipeline; the networks are untrained, so nothing is said of the method's own errors.
PairEvaluationOptions ThreePairsOfEach() {
  PairEvaluationOptions options;
  options.seed = 5;
  options.pairs = 3;
  return options;
}

TEST(EvaluatePairs, HasTheSameRowsForEachPairInOrder) {
  int calls = 0, last = 0;
  const std::vector<EvaluationRow> rows = EvaluatePairs(
      testing::SmallGenerator(), testing::UntrainedPipeline(), ThreePairsOfEach(), [&](int done) {
        ++calls;
        last = done;
      });
  EXPECT_EQ(calls, 6);
  EXPECT_EQ(last, 6);
  const std::vector<std::string> methods = {"skeletal", kUnchanged, kMethodTrueRotations,
                                            kPaper,     kInherited, kAllTrue};
  const std::vector<std::string> pairs = {"moderate-0", "moderate-1", "moderate-2",
                                          "hard-0",     "hard-1",     "hard-2"};
  ASSERT_EQ(rows.size(), pairs.size() * methods.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].pair, pairs[i / methods.size()]);
    EXPECT_EQ(rows[i].method, methods[i % methods.size()]);
    EXPECT_EQ(rows[i].failure, "");
    EXPECT_EQ(rows[i].seconds > 0, rows[i].method == "skeletal");
  }
  for (size_t pair = 0; pair < pairs.size(); ++pair) {  // the truth's own parts beat doing nothing
    EXPECT_LT(rows[pair * methods.size() + 5].errors.mean_mm, rows[pair * methods.size() + 1].errors.mean_mm);
  }
}

TEST(EvaluatePairs, DoesNotDependOnTheNumberOfThreads) {
  PairEvaluationOptions options = ThreePairsOfEach();
  options.parts = false;
  const auto without_times = [](std::vector<EvaluationRow> rows) {
    for (EvaluationRow& row : rows) row.seconds = 0;
    return RowsCsv(rows);
  };
  const std::string one =
      without_times(EvaluatePairs(testing::SmallGenerator(), testing::UntrainedPipeline(), options));
  options.threads = 3;
  EXPECT_EQ(without_times(EvaluatePairs(testing::SmallGenerator(), testing::UntrainedPipeline(), options)),
            one);
}

TEST(EvaluatePairs, ARefusedTransferIsARowsFailure) {
  PairEvaluationOptions options = ThreePairsOfEach();
  options.transfer.limits.max_vertices = 10;
  const std::vector<EvaluationRow> rows =
      EvaluatePairs(testing::SmallGenerator(), testing::UntrainedPipeline(), options);
  ASSERT_EQ(rows.size(), 36u);
  EXPECT_NE(rows[0].failure.find("INVALID_ARGUMENT"), std::string::npos) << rows[0].failure;
  EXPECT_NE(rows[2].failure, "");  // the method's rig is missing
  EXPECT_EQ(rows[5].failure, "");
}

TEST(PoseMixName, NamesEachMix) {
  EXPECT_EQ(PoseMixName(PoseMix::kModerate), "moderate");
  EXPECT_EQ(PoseMixName(PoseMix::kHard), "hard");
  EXPECT_EQ(PoseMixName(PoseMix::kTraining), "training");
}

}  // namespace
}  // namespace stance
