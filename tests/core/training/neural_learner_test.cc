// The stages of METHOD_NEURAL on small data: pairs, learning, order, resuming, export.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/network/model_files.h"
#include "core/network/neural_model.h"
#include "core/training/neural_samples.h"
#include "core/training/trainer.h"
#include "core/training/training_log.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

class NeuralLearnerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::TemporaryFolder data;
    testing::WriteSmallBody(data.path() / "body");
    testing::WriteSmallMotions(data.path() / "motions", 12);
    auto generator = CharacterGenerator::FromData(data.path() / "body", data.path() / "motions");
    ASSERT_TRUE(generator.ok()) << generator.status();
    generator_ = std::move(*generator);
  }
  static void TearDownTestSuite() { generator_.reset(); }

  TrainingOptions Options(TrainingStage stage, const char* folder, int64_t pairs) const {
    TrainingOptions options = DefaultTrainingOptions(stage);
    options.work_dir = work_.path() / folder;
    options.samples_per_mesh = 64;
    options.batch_size = 2;
    options.total_samples = pairs;
    options.learning_rate = 1e-3;
    return options;
  }
  absl::Status Run(const TrainingOptions& options) {
    return Train(*generator_, options, [this](const std::string& line) { report_ += line + "\n"; });
  }
  // Means over the first eight steps, and over the last ones.
  std::pair<LogRow, LogRow> FirstAndLast(TrainingOptions options) {
    constexpr int kFirst = 8;
    options.max_hours = 0;  // stops, resumable, after a step
    for (int i = 0; i < kFirst; ++i) EXPECT_TRUE(Run(options).ok());
    options.max_hours = 1;
    EXPECT_TRUE(Run(options).ok());
    const auto log = ReadLog(options.work_dir / (TrainingStageName(options.stage) + ".csv"));
    EXPECT_TRUE(log.ok() && log->size() > kFirst);
    if (!log.ok() || log->size() <= kFirst) return {};
    LogRow first;
    for (int i = 0; i < kFirst; ++i) {
      first.loss += (*log)[i].loss / kFirst;
      first.transfer_mm += (*log)[i].transfer_mm / kFirst;
    }
    return {first, log->back()};
  }
  absl::Status Export(const std::filesystem::path& work, const std::filesystem::path& dir) const {
    ModelManifest manifest;
    manifest.name = "tiny";
    manifest.version = "5";
    manifest.method = kNeuralMethod;
    return ExportModel(work, dir, manifest);
  }

  static inline std::unique_ptr<CharacterGenerator> generator_;
  testing::TemporaryFolder work_;
  std::string report_;
};

TEST_F(NeuralLearnerTest, PairsDependOnSeedAndIndexAlone) {
  const SampleOptions options{3, 64, 12};
  PairStream stream(*generator_, options, 1);
  const NeuralBatch some = stream.MakeBatch(5, 1), more = stream.MakeBatch(4, 3);
  EXPECT_EQ(more.pair_count(), 3);
  EXPECT_TRUE(some.target.equal(more.target.slice(0, 64, 128)));
  EXPECT_TRUE(some.joints[0].equal(more.joints[1]));
  EXPECT_TRUE(some.joints[1].equal(more.joints[4]));
  EXPECT_FALSE(more.target.slice(0, 0, 64).equal(more.target.slice(0, 64, 128)));
}

TEST_F(NeuralLearnerTest, TheTargetIsTheSourcesSurfaceElsewhere) {
  SampleOptions options{4, 128, 12};
  options.augment = false;
  const NeuralBatch batch = PairStream(*generator_, options, 1).MakeBatch(0, 4);
  EXPECT_EQ(batch.input.mesh_count(), 8);
  EXPECT_EQ(batch.target.size(0), batch.source_rows());
  EXPECT_LT((batch.weights.sum(1) - 1).abs().max().item<float>(), 1e-4);
  EXPECT_LE(batch.joints.abs().max().item<float>(), 0.6f);
  const auto from = batch.edges.select(1, 0), to = batch.edges.select(1, 1);
  EXPECT_TRUE((from < to).all().item<bool>());
  EXPECT_LT(to.max().item<int64_t>(), batch.source_rows());
  const auto lengths = [&](const torch::Tensor& points) {
    return (points.index_select(0, to) - points.index_select(0, from)).norm(2, 1);
  };
  const auto points = batch.input.points.slice(0, 0, batch.source_rows());
  // Limbs bend, but hardly stretch.
  EXPECT_LT((lengths(batch.target) / lengths(points) - 1).abs().median().item<float>(), 0.05);
  EXPECT_GT((batch.target - points).norm(2, 1).mean().item<float>(), 0.02);
}

TEST_F(NeuralLearnerTest, APairComesAgainChanged) {
  const SampleOptions options{5, 64, 12};
  PairStream stream(*generator_, options, 4), again(*generator_, options, 4), once(*generator_, options, 1);
  const NeuralBatch batch = stream.MakeBatch(0, 4);  // the first pair, four times
  const NeuralBatch made = once.MakeBatch(0, 1);
  EXPECT_TRUE(again.MakeBatch(2, 1).target.equal(batch.target.slice(0, 128, 192)));
  for (int64_t i = 0; i < 4; ++i) {
    const auto target = batch.target.slice(0, 64 * i, 64 * (i + 1));
    EXPECT_FALSE(target.equal(made.target));
    for (int64_t j = 0; j < i; ++j) EXPECT_FALSE(target.equal(batch.target.slice(0, 64 * j, 64 * (j + 1))));
    // The same pair: it differs by a rigid motion, a mirror, and the unit of its box.
    const auto shape = [](const torch::Tensor& points) {
      const auto distances = torch::pdist(points);
      return distances / distances.mean();
    };
    EXPECT_LT((shape(target) - shape(made.target)).abs().max().item<float>(), 1e-3);
  }
}

NeuralPair SomePair() {
  std::srand(4);
  const auto side = [] {
    return PairSide{{Points::Random(9, 3), NeighborTable::Zero(9, 2)},
                    RowMatrix::Random(9, kHumanJoints).cwiseAbs(),
                    Points::Random(kHumanJoints, 3)};
  };
  return {side(), side(), Points::Random(9, 3)};
}

TEST(NeuralPair, TurnsAsAWholeByEqualTurns) {
  const NeuralPair pair = SomePair();
  const Rotation turn = Eigen::Quaternionf::UnitRandom().toRotationMatrix();
  const NeuralPair turned = Turned(pair, turn, turn);
  EXPECT_LT((turned.target - pair.target * turn.transpose()).norm(), 1e-5f);
  EXPECT_LT((turned.source.joints - pair.source.joints * turn.transpose()).norm(), 1e-5f);
  EXPECT_LT((turned.reference.input.points - pair.reference.input.points * turn.transpose()).norm(), 1e-5f);
}

TEST(NeuralPair, ATurnedReferenceTurnsTheTargetAboutTheSourcesPelvis) {
  const NeuralPair pair = SomePair();
  const Rotation turn = Eigen::Quaternionf::UnitRandom().toRotationMatrix();
  const NeuralPair turned = Turned(pair, Rotation::Identity(), turn);
  EXPECT_EQ(turned.source.input.points, pair.source.input.points);
  const Eigen::RowVector3f pelvis = pair.source.joints.row(kPelvis);
  EXPECT_LT(((turned.target.rowwise() - pelvis) - (pair.target.rowwise() - pelvis) * turn.transpose()).norm(),
            1e-5f);
}

TEST(NeuralPair, MirroredTwiceIsItself) {
  const NeuralPair pair = SomePair();
  const NeuralPair mirrored = Mirrored(pair), twice = Mirrored(mirrored);
  EXPECT_EQ(mirrored.source.weights.col(kLeftElbow), pair.source.weights.col(kRightElbow));
  EXPECT_EQ(mirrored.target.col(0), -pair.target.col(0));
  EXPECT_EQ(twice.target, pair.target);
  EXPECT_EQ(twice.reference.joints, pair.reference.joints);
  EXPECT_EQ(twice.reference.weights, pair.reference.weights);
}

TEST_F(NeuralLearnerTest, TheThreeStagesLearnAndExport) {
  // Rigging: the loss falls, and most of the 24 joints are told apart better than by guessing (0.04).
  const auto [rigging_first, rigging] = FirstAndLast(Options(TrainingStage::kRigging, "run", 120));
  EXPECT_LT(rigging.loss, 0.7 * rigging_first.loss);
  EXPECT_GT(rigging.accuracy, 0.1);
  // Transfer: nearer to the truth than at the beginning.
  const auto [transfer_first, transfer] = FirstAndLast(Options(TrainingStage::kTransfer, "run", 120));
  EXPECT_LT(transfer.loss, 0.7 * transfer_first.loss);
  EXPECT_LT(transfer.transfer_mm, transfer_first.transfer_mm);

  const auto dir = work_.path() / "model";
  ASSERT_TRUE(Export(work_.path() / "run", dir).ok());
  const TensorMap before = *ReadWeights(dir, *ReadManifest(dir));
  ASSERT_TRUE(Run(Options(TrainingStage::kWhole, "run", 4)).ok());
  ASSERT_TRUE(Export(work_.path() / "run", dir).ok());
  const auto model = NeuralModel::Load(dir);
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ((*model)->manifest().samples, 64);
  EXPECT_EQ((*model)->manifest().version, "5");
  TensorMap after = *ReadWeights(dir, *ReadManifest(dir));
  for (const char* name : {"rigging.f_s.out.weight", "rigging.f_c.out.weight", "transfer.out.weight"}) {
    ASSERT_TRUE(before.contains(name)) << name;
    EXPECT_FALSE(before.at(name).equal(after[name])) << name;
  }
  EXPECT_NE(report_.find("pairs"), std::string::npos);
}

TEST_F(NeuralLearnerTest, AResumedRunEqualsAnUnbrokenOne) {
  TensorMap tensors[2];
  for (const bool broken : {false, true}) {
    const char* folder = broken ? "broken" : "whole";
    for (const TrainingStage stage : {TrainingStage::kRigging, TrainingStage::kTransfer}) {
      TrainingOptions options = Options(stage, folder, 6);
      options.max_hours = broken ? 0 : 1;
      for (int i = 0; i < (broken ? 3 : 1); ++i) ASSERT_TRUE(Run(options).ok());
    }
    const auto dir = work_.path() / (std::string(folder) + "_model");
    ASSERT_TRUE(Export(work_.path() / folder, dir).ok());
    tensors[broken] = *ReadWeights(dir, *ReadManifest(dir));
  }
  EXPECT_NE(report_.find("resuming transfer at 4 pairs"), std::string::npos) << report_;
  for (const auto& [name, tensor] : tensors[0]) EXPECT_TRUE(tensor.equal(tensors[1][name])) << name;
}

TEST_F(NeuralLearnerTest, EachStageNeedsThoseBefore) {
  for (const TrainingStage stage : {TrainingStage::kTransfer, TrainingStage::kWhole}) {
    const absl::Status status = Run(Options(stage, "empty", 4));
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    EXPECT_NE(std::string(status.message()).find("'rigging'"), std::string::npos) << status;
  }
  EXPECT_EQ(Export(work_.path() / "empty", work_.path() / "none").code(),
            absl::StatusCode::kFailedPrecondition);
  ASSERT_TRUE(Run(Options(TrainingStage::kRigging, "mixed", 2)).ok());
  TrainingOptions more = Options(TrainingStage::kTransfer, "mixed", 2);
  more.samples_per_mesh = 96;
  EXPECT_EQ(Run(more).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(NeuralLearnerTest, StagesHaveAMethodAndThePapersRates) {
  EXPECT_EQ(TrainingStageMethod(TrainingStage::kBoth), kSkeletalMethod);
  EXPECT_EQ(TrainingStageMethod(TrainingStage::kPose), kStanceMethod);
  for (const auto& [name, pairs, rate] :
       {std::tuple{"rigging", 8, 1e-4}, std::tuple{"transfer", 8, 5e-5}, std::tuple{"whole", 4, 5e-5}}) {
    const TrainingStage stage = *TrainingStageFromName(name);
    EXPECT_EQ(TrainingStageName(stage), name);
    EXPECT_EQ(TrainingStageMethod(stage), kNeuralMethod);
    EXPECT_EQ(DefaultTrainingOptions(stage).batch_size, pairs);
    EXPECT_EQ(DefaultTrainingOptions(stage).learning_rate, rate);
  }
}

}  // namespace
}  // namespace stance
