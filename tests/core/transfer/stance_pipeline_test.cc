// The pipeline of METHOD_STANCE: the properties that hold for any network, random ones here.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/network/pose_model.h"
#include "core/transfer/confidence.h"
#include "core/transfer/pipeline.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class StancePipelineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::UntrainedModel files(256, 2, "stance");
    auto pipeline = Pipeline::Load(files.dir(), {.threads = 2});
    ASSERT_TRUE(pipeline.ok()) << pipeline.status();
    pipeline_ = std::move(*pipeline);
  }
  static void TearDownTestSuite() { pipeline_.reset(); }

  static TransferOptions Options() {
    TransferOptions options;
    options.method = Method::kStance;
    return options;
  }
  static inline std::unique_ptr<Pipeline> pipeline_;
};

TriangleMesh Lopsided() {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.2f, 24, 6, 20);
  mesh.positions.col(0) += 0.2f * mesh.positions.col(1).cwiseAbs2() + 0.1f * mesh.positions.col(2);
  return mesh;
}

TEST_F(StancePipelineTest, SaysWhatItIs) {
  ASSERT_EQ(pipeline_->models().size(), 1u);
  EXPECT_EQ(pipeline_->models()[0].method, Method::kStance);
  EXPECT_GT(pipeline_->models()[0].parameter_count, 500'000);
  EXPECT_TRUE(pipeline_->WarmUp().ok());
}

TEST_F(StancePipelineTest, HasNoFullResolution) {
  const testing::UntrainedModel files(256, 3, "stance");
  const absl::Status status = Pipeline::Load(files.dir(), {.threads = 1, .full_resolution = true}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(status.message()).find("full_resolution"), std::string::npos) << status;
}

TEST_F(StancePipelineTest, RefusesAnotherMethod) {
  const absl::Status status =
      pipeline_->Transfer(Lopsided(), Lopsided(), {.method = Method::kSkeletal}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(std::string(status.message()), "options: method: 'skeletal' has no model here; loaded: stance");
}

TEST_F(StancePipelineTest, OwnPoseLeavesTheMeshUnchanged) {
  const TriangleMesh mesh = Lopsided();
  const auto result = pipeline_->Transfer(mesh, mesh, Options());
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_LT((result->target.positions - mesh.positions).cwiseAbs().maxCoeff(), 1e-3f);
}

TEST_F(StancePipelineTest, WeightsConfidencesAndRotationsAreProper) {
  TransferOptions options = Options();
  options.reference_weights = true;
  for (const TriangleMesh& reference : {testing::Box(), testing::Fan(4), testing::TwoSpheres(3)}) {
    const auto result = pipeline_->Transfer(Lopsided(), reference, options);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_TRUE(result->target.positions.allFinite());
    for (const Rig* rig : {&result->source_rig, &result->reference_rig}) {
      EXPECT_GE(rig->weights.minCoeff(), 0);
      EXPECT_LT((rig->weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
      EXPECT_LE((rig->weights.array() > 0).rowwise().count().maxCoeff(), 4);
      ASSERT_EQ(rig->confidence.size(), kHumanJoints);
      EXPECT_GE(rig->confidence.minCoeff(), 0);
      EXPECT_LE(rig->confidence.maxCoeff(), 1);
      ASSERT_EQ(rig->rotations.size(), static_cast<size_t>(kHumanJoints));
      for (const Rotation& rotation : rig->rotations) {
        EXPECT_LT((rotation * rotation.transpose() - Rotation::Identity()).norm(), 1e-4f);
      }
    }
  }
}

// The calibration of the manifest acts on the mean over the views, and on nothing but the confidences.
TEST_F(StancePipelineTest, ConfidencesAreCalibratedAsTheManifestSays) {
  const ConfidenceCalibration calibration{.scale = 0.5, .bias = 1.25};
  const std::filesystem::path dir = std::filesystem::path(::testing::TempDir()) / "stance_calibrated";
  ModelManifest manifest;
  manifest.samples = 256;
  manifest.confidence = calibration;
  ASSERT_TRUE(PoseModel::WriteUntrained(dir, 2, manifest).ok());
  const auto calibrated = Pipeline::Load(dir, {.threads = 2});
  ASSERT_TRUE(calibrated.ok()) << calibrated.status();
  EXPECT_EQ((*calibrated)->models()[0].confidence, calibration);
  EXPECT_EQ(pipeline_->models()[0].confidence, ConfidenceCalibration());
  const auto plain = pipeline_->RigMesh(Lopsided(), Options()),
             rig = (*calibrated)->RigMesh(Lopsided(), Options());
  ASSERT_TRUE(plain.ok() && rig.ok());
  EXPECT_LT((rig->rig.joints - plain->rig.joints).cwiseAbs().maxCoeff(), 1e-5f);
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_NEAR(rig->rig.confidence[j], CalibratedConfidence(plain->rig.confidence[j], calibration), 1e-5);
  }
  std::filesystem::remove_all(dir);
}

TEST_F(StancePipelineTest, ABatchGivesWhatEachPairGivesAlone) {
  const TriangleMesh a = Lopsided(), b = testing::Icosphere(4), c = testing::Capsule();
  const std::vector<TransferJob> jobs = {{&a, &b, Options()}, {&c, &a, Options()}};
  const auto results = pipeline_->TransferBatch(jobs);
  for (size_t i = 0; i < jobs.size(); ++i) {
    const auto alone = pipeline_->Transfer(*jobs[i].source, *jobs[i].reference, Options());
    ASSERT_TRUE(results[i].ok() && alone.ok());
    EXPECT_LT((results[i]->target.positions - alone->target.positions).cwiseAbs().maxCoeff(), 1e-3f);
  }
}

TEST_F(StancePipelineTest, TheUpAxisTurnsTheAnswerAndNothingElse) {
  const TriangleMesh source = Lopsided(), reference = testing::Capsule();
  TriangleMesh turned = source;
  for (int64_t v = 0; v < turned.vertex_count(); ++v) {  // x, y, z of y up are x, -z, y of z up
    turned.positions.row(v) << source.positions(v, 0), -source.positions(v, 2), source.positions(v, 1);
  }
  TransferOptions options = Options();
  const auto plain = pipeline_->Transfer(source, reference, options);
  options.source_up = UpAxis::kZ;
  const auto result = pipeline_->Transfer(turned, reference, options);
  ASSERT_TRUE(plain.ok() && result.ok());
  Points back = result->target.positions;
  back.col(1) = result->target.positions.col(2);
  back.col(2) = -result->target.positions.col(1);
  EXPECT_LT((back - plain->target.positions).cwiseAbs().maxCoeff(), 1e-3f);
  const Rotation to_y_up = Eigen::AngleAxisf(-EIGEN_PI / 2, Eigen::Vector3f::UnitX()).toRotationMatrix();
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_LT((to_y_up * result->source_rig.rotations[j] - plain->source_rig.rotations[j]).norm(), 1e-2f);
  }
}

}  // namespace
}  // namespace stance
