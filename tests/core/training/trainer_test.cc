#include "core/training/trainer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/files.h"
#include "core/network/model_files.h"
#include "core/network/pose_model.h"
#include "core/network/skeletal_model.h"
#include "core/training/batch_stream.h"
#include "core/training/sample_stream.h"
#include "core/training/training_log.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

class TrainerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    data_ = std::make_unique<testing::TemporaryFolder>();
    testing::WriteSmallBody(data_->path() / "body");
    testing::WriteSmallMotions(data_->path() / "motions", 12);
    auto generator = CharacterGenerator::FromData(data_->path() / "body", data_->path() / "motions");
    ASSERT_TRUE(generator.ok()) << generator.status();
    generator_ = std::move(*generator);
  }
  static void TearDownTestSuite() {
    generator_.reset();
    data_.reset();
  }

  TrainingOptions Options(TrainingStage stage, const char* folder, int64_t samples) const {
    TrainingOptions options;
    options.stage = stage;
    options.work_dir = work_.path() / folder;
    options.samples_per_mesh = 96;
    options.batch_size = 4;
    options.total_samples = samples;
    options.loss_points = 48;
    return options;
  }
  absl::Status Run(const TrainingOptions& options) {
    return Train(*generator_, options, [this](const std::string& line) { report_ += line + "\n"; });
  }

  static inline std::unique_ptr<testing::TemporaryFolder> data_;
  static inline std::unique_ptr<CharacterGenerator> generator_;
  testing::TemporaryFolder work_;
  std::string report_;
};

ModelManifest Manifest(const char* name, const char* version, const char* method = kSkeletalMethod) {
  ModelManifest manifest;
  manifest.name = name;
  manifest.version = version;
  manifest.method = method;
  return manifest;
}

TEST_F(TrainerTest, BatchesDependOnSeedAndIndexAlone) {
  const SampleOptions options{3, 96, 12};
  BatchStream<TrainingBatch> stream(
      [&](int64_t first) { return MakeTrainingBatch(*generator_, options, first, 4); }, 8, 4, 2);
  for (int64_t first = 8; first < 24; first += 4) {
    const TrainingBatch streamed = stream.Next(), made = MakeTrainingBatch(*generator_, options, first, 4);
    EXPECT_TRUE(streamed.input.points.equal(made.input.points));
    EXPECT_TRUE(streamed.input.one_ring.equal(made.input.one_ring));
    EXPECT_TRUE(streamed.joint_of.equal(made.joint_of));
    EXPECT_TRUE(streamed.joints.equal(made.joints));
  }
}

TEST_F(TrainerTest, BatchesHoldNormalisedPointsAndValidTargets) {
  const TrainingBatch batch = MakeTrainingBatch(*generator_, {5, 96, 12}, 0, 4);
  EXPECT_EQ(batch.input.points.size(0), 4 * 96);
  EXPECT_LE(batch.input.points.abs().max().item<float>(), 0.51f);
  EXPECT_GE(batch.joint_of.min().item<int64_t>(), 0);
  EXPECT_LT(batch.joint_of.max().item<int64_t>(), 24);
  EXPECT_LE(batch.joints.abs().max().item<float>(), 0.6f);  // joints lie within the body's box, or nearly
}

TEST_F(TrainerTest, TheThreeStagesRunLearnAndExport) {
  for (const auto& [stage, samples] :
       {std::pair{TrainingStage::kWeights, 160}, std::pair{TrainingStage::kJoints, 160},
        std::pair{TrainingStage::kBoth, 8}}) {
    const auto status = Run(Options(stage, "run", samples));
    ASSERT_TRUE(status.ok()) << status;
  }
  // Learns: after 160 characters f_C is far better than guessing among 24 joints (cross-entropy ln 24 = 3.2).
  const auto log = ReadLog(work_.path() / "run" / "weights.csv");
  ASSERT_TRUE(log.ok());
  ASSERT_FALSE(log->empty());
  EXPECT_LT(log->back().loss, 2.8);
  EXPECT_EQ(log->back().seen, 160);
  EXPECT_NE(report_.find("samples/s"), std::string::npos);
  EXPECT_NE((*ReadFile(work_.path() / "run" / "joints.svg")).find("<polyline"), std::string::npos);

  const auto model_dir = work_.path() / "model";
  ASSERT_TRUE(ExportModel(work_.path() / "run", model_dir, Manifest("tiny", "7")).ok());
  const auto model = SkeletalModel::Load(model_dir);
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ((*model)->manifest().samples, 96);
  EXPECT_EQ((*model)->manifest().version, "7");
}

TEST_F(TrainerTest, TheStagePoseLearns) {
  TrainingOptions options = Options(TrainingStage::kPose, "pose", 320);
  options.batch_size = 8;
  options.learning_rate = 2e-3;
  ASSERT_TRUE(Run(options).ok());
  const auto log = ReadLog(work_.path() / "pose" / "pose.csv");
  ASSERT_TRUE(log.ok());
  ASSERT_FALSE(log->empty());
  EXPECT_GT(log->back().accuracy, 0.15);  // guessing gives 0.04
  EXPECT_GT(log->back().degrees, 0);
  EXPECT_LT(log->back().degrees, 120);  // random rotations are 126 degrees apart

  const auto dir = work_.path() / "model";
  ASSERT_TRUE(ExportModel(options.work_dir, dir, Manifest("tiny", "3", kStanceMethod)).ok());
  const auto model = PoseModel::Load(dir);
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ((*model)->manifest().samples, 96);
  EXPECT_EQ((*model)->manifest().version, "3");
  EXPECT_EQ(SkeletalModel::Load(dir).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ExportModel(work_.path() / "none", dir, Manifest("tiny", "3", kStanceMethod)).code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(TrainerTest, TheStageRefinementFollowsTheStagePose) {
  TrainingOptions options = Options(TrainingStage::kRefinement, "refined", 16);
  const absl::Status early = Run(options);
  EXPECT_EQ(early.code(), absl::StatusCode::kFailedPrecondition) << early;
  EXPECT_NE(std::string(early.message()).find("'pose'"), std::string::npos) << early;

  ASSERT_TRUE(Run(Options(TrainingStage::kPose, "refined", 8)).ok());
  options.samples_per_mesh = 128;  // the first network's are 96
  EXPECT_EQ(Run(options).code(), absl::StatusCode::kFailedPrecondition);
  options.samples_per_mesh = 96;
  const absl::Status trained = Run(options);
  ASSERT_TRUE(trained.ok()) << trained;
  EXPECT_NE(report_.find("starting from"), std::string::npos) << report_;
  options.total_samples = 24;
  ASSERT_TRUE(Run(options).ok());
  EXPECT_NE(report_.find("resuming refinement at 16"), std::string::npos) << report_;

  const auto dir = work_.path() / "model";
  ASSERT_TRUE(ExportModel(options.work_dir, dir, Manifest("tiny", "4", kStanceMethod)).ok());
  const auto model = PoseModel::Load(dir);
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_TRUE((*model)->refines());
}

TEST_F(TrainerTest, ARunStartsFromAnothersWeights) {
  TrainingOptions first = Options(TrainingStage::kPose, "first", 8);
  ASSERT_TRUE(Run(first).ok());
  TrainingOptions second = Options(TrainingStage::kPose, "second", 8);
  second.start_from = first.work_dir;
  second.samples_per_mesh = 128;  // may differ, unlike a resumed run's
  ASSERT_TRUE(Run(second).ok());
  EXPECT_NE(report_.find("starting from"), std::string::npos) << report_;
  second.work_dir = work_.path() / "third";
  second.start_from = work_.path() / "none";
  EXPECT_EQ(Run(second).code(), absl::StatusCode::kNotFound);
}

TEST_F(TrainerTest, AResumedRunEqualsAnUnbrokenOne) {
  TrainingOptions whole = Options(TrainingStage::kJoints, "whole", 32);
  ASSERT_TRUE(Run(whole).ok());
  TrainingOptions broken = Options(TrainingStage::kJoints, "broken", 32);
  broken.max_hours = 0;  // stops, resumable, after each step
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(Run(broken).ok());
  // Both then start stage weights, needed for an export, alike.
  for (TrainingOptions* options : {&whole, &broken}) {
    options->stage = TrainingStage::kWeights;
    options->total_samples = 4;
    options->max_hours = 1;
    ASSERT_TRUE(Run(*options).ok());
  }
  TensorMap tensors[2];
  for (const int i : {0, 1}) {
    const auto dir = work_.path() / ("model" + std::to_string(i));
    ASSERT_TRUE(ExportModel(i == 0 ? whole.work_dir : broken.work_dir, dir, Manifest("tiny", "1")).ok());
    tensors[i] = *ReadWeights(dir, *ReadManifest(dir));
  }
  for (const auto& [name, tensor] : tensors[0]) EXPECT_TRUE(tensor.equal(tensors[1][name])) << name;
}

TEST_F(TrainerTest, RefusesWhatItCannotDo) {
  EXPECT_EQ(Run(Options(TrainingStage::kBoth, "empty", 8)).code(), absl::StatusCode::kFailedPrecondition);
  TrainingOptions tiny = Options(TrainingStage::kWeights, "tiny", 8);
  tiny.samples_per_mesh = 10;
  EXPECT_EQ(Run(tiny).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(TrainingStageFromName("dreams").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(ExportModel(work_.path() / "nothing", work_.path() / "model", Manifest("x", "1")).ok());
}

TEST_F(TrainerTest, NamesTheOptionThatIsOutOfRange) {
  struct Case {
    const char* name;
    void (*spoil)(TrainingOptions&);
  };
  for (const Case& bad : {
           Case{"samples_per_mesh: 63", [](TrainingOptions& o) { o.samples_per_mesh = 63; }},
           Case{"max_ring: 65", [](TrainingOptions& o) { o.max_ring = 65; }},
           Case{"batch_size: 0", [](TrainingOptions& o) { o.batch_size = 0; }},
           Case{"total_samples: -1", [](TrainingOptions& o) { o.total_samples = -1; }},
           Case{"loss_points: 0", [](TrainingOptions& o) { o.loss_points = 0; }},
           Case{"threads: 0", [](TrainingOptions& o) { o.threads = 0; }},
           Case{"generator_threads: 0", [](TrainingOptions& o) { o.generator_threads = 0; }},
           Case{"learning_rate: nan", [](TrainingOptions& o) { o.learning_rate = std::nan(""); }},
           Case{"final_rate: 2", [](TrainingOptions& o) { o.final_rate = 2; }},
           Case{"rigged_share: 2", [](TrainingOptions& o) { o.rigged_share = 2; }},
           Case{"rigged_share: 0.5, but",
                [](TrainingOptions& o) { o.rigged_share = 0.5; }},  // there are none
           Case{"max_hours: -1", [](TrainingOptions& o) { o.max_hours = -1; }},
           Case{"device: 'tpu'", [](TrainingOptions& o) { o.device = "tpu"; }},
       }) {
    TrainingOptions options = Options(TrainingStage::kWeights, "bad", 8);
    bad.spoil(options);
    const absl::Status status = Run(options);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad.name;
    EXPECT_NE(std::string(status.message()).find(bad.name), std::string::npos) << status;
  }
}

// The two stages must have seen the same meshes, and a stage goes on with those it began with.
TEST_F(TrainerTest, RefusesCheckpointsOfOtherSamples) {
  ASSERT_TRUE(Run(Options(TrainingStage::kWeights, "mixed", 4)).ok());
  TrainingOptions more = Options(TrainingStage::kJoints, "mixed", 4);
  more.samples_per_mesh = 128;
  ASSERT_TRUE(Run(more).ok());
  more.stage = TrainingStage::kBoth;
  EXPECT_EQ(Run(more).code(), absl::StatusCode::kFailedPrecondition);
  more.stage = TrainingStage::kWeights;
  const absl::Status status = Run(more);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(std::string(status.message()).find("96 samples per mesh"), std::string::npos) << status;
  EXPECT_EQ(ExportModel(work_.path() / "mixed", work_.path() / "model", Manifest("x", "1")).code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(TrainerTest, ALossThatIsNotFiniteStopsTheStage) {
  TrainingOptions wild = Options(TrainingStage::kJoints, "wild", 4000);
  wild.learning_rate = 1e30;
  const absl::Status status = Run(wild);
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_NE(std::string(status.message()).find("not finite"), std::string::npos) << status;
}

TEST_F(TrainerTest, OneAugmentedCharacterInTenHasHoles) {
  std::set<int64_t> whole;  // face counts of the body's levels
  for (int i = 0; i < 40; ++i) whole.insert(generator_->Make(1, i, {.vertices = -1}).mesh.face_count());
  int holed = 0;
  for (int i = 0; i < 300; ++i) {
    holed += whole.contains(MakeTrainingCharacter(*generator_, {7, 96, 12}, i).mesh.face_count()) ? 0 : 1;
  }
  EXPECT_NEAR(holed, 30, 15);
  SampleOptions plain{7, 96, 12};
  plain.augment = false;
  for (int i = 0; i < 40; ++i) {
    EXPECT_TRUE(whole.contains(MakeTrainingCharacter(*generator_, plain, i).mesh.face_count()));
  }
}

TEST_F(TrainerTest, ASampleHasTheLabelOfItsPlace) {
  const Character character = generator_->Make(1, 0, {});
  const SurfaceSamples samples = ResampleSurface(character.mesh, {96, 12});
  const std::vector<int32_t> labels = LabelsOfSamples(character, samples);
  ASSERT_EQ(std::ssize(labels), samples.points.rows());
  for (size_t s = 0; s < labels.size(); ++s) {
    const SurfacePlace& place = samples.place[s];
    Eigen::RowVectorXf weights = Eigen::RowVectorXf::Zero(kHumanJoints);
    for (int i = 0; i < 3; ++i) weights += place.weight[i] * character.weights.row(place.corner[i]);
    EXPECT_NEAR(weights[labels[s]], weights.maxCoeff(), 1e-6f);
  }
}

TEST_F(TrainerTest, ADamagedCheckpointIsDataLoss) {
  const TrainingOptions options = Options(TrainingStage::kWeights, "damaged", 8);
  std::filesystem::create_directories(options.work_dir);
  ASSERT_TRUE(WriteFile(options.work_dir / "weights.ckpt", "not a checkpoint").ok());
  EXPECT_EQ(Run(options).code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace stance
