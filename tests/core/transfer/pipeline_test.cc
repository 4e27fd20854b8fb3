#include "core/transfer/pipeline.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <atomic>
#include <limits>

#include "tests/support/meshes.h"
#include "tests/support/puppet.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

// The properties of a transfer that hold for any networks: random ones here.
class PipelineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::UntrainedModel files(256);
    auto pipeline = Pipeline::Load(files.dir(), {.threads = 2});
    ASSERT_TRUE(pipeline.ok()) << pipeline.status();
    pipeline_ = std::move(*pipeline);
  }
  static void TearDownTestSuite() { pipeline_.reset(); }
  static inline std::unique_ptr<Pipeline> pipeline_;
};

TriangleMesh Lopsided() {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.2f, 24, 6, 20);
  mesh.positions.col(0) += 0.2f * mesh.positions.col(1).cwiseAbs2() + 0.1f * mesh.positions.col(2);
  return mesh;
}

TEST_F(PipelineTest, OwnPoseLeavesTheMeshUnchanged) {
  const TriangleMesh mesh = Lopsided();
  for (const Twist twist : {Twist::kPaper, Twist::kInherited}) {
    const auto result = pipeline_->Transfer(mesh, mesh, {.twist = twist});
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_LT((result->target.positions - mesh.positions).cwiseAbs().maxCoeff(), 1e-3f);
  }
}

TEST_F(PipelineTest, TargetKeepsEverythingButTheShape) {
  const TriangleMesh source = testing::WithAttributes(Lopsided());
  const auto result = pipeline_->Transfer(source, testing::Capsule());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->target.faces, source.faces);
  EXPECT_EQ(result->target.texcoords, source.texcoords);
  EXPECT_EQ(result->target.groups.size(), source.groups.size());
  ASSERT_EQ(result->target.normals.rows(), source.vertex_count());
  EXPECT_LT((result->target.normals.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-3f);
  EXPECT_TRUE(result->target.positions.allFinite());
}

TEST_F(PipelineTest, WeightsAreNonNegativeSumToOneAndAreFewEnough) {
  TransferOptions options;
  options.reference_weights = true;
  const TriangleMesh source = Lopsided(), reference = testing::Box();
  const auto result = pipeline_->Transfer(source, reference, options);
  ASSERT_TRUE(result.ok());
  for (const auto& [rig, mesh] :
       {std::pair{&result->source_rig, &source}, std::pair{&result->reference_rig, &reference}}) {
    ASSERT_EQ(rig->weights.rows(), mesh->vertex_count());
    EXPECT_GE(rig->weights.minCoeff(), 0);
    EXPECT_LT((rig->weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
    EXPECT_LE((rig->weights.array() > 0).rowwise().count().maxCoeff(), 4);
  }
}

TEST_F(PipelineTest, TargetIsTheSkinnedSource) {
  const TriangleMesh source = Lopsided();
  const auto result = pipeline_->Transfer(source, testing::Capsule());
  ASSERT_TRUE(result.ok());
  for (const int64_t v : {0, 100, 200}) {
    Eigen::Vector3f expected = Eigen::Vector3f::Zero();
    for (int j = 0; j < kHumanJoints; ++j) {
      expected += result->source_rig.weights(v, j) * result->transforms[j].Apply(source.positions.row(v));
    }
    EXPECT_LT((result->target.positions.row(v).transpose() - expected).norm(), 1e-4f);
  }
  for (int j = 0; j < kHumanJoints; ++j) {
    const Eigen::Vector3f joint = result->transforms[j].Apply(result->source_rig.joints.row(j));
    EXPECT_LT((result->target_joints.row(j).transpose() - joint).norm(), 1e-5f);
  }
}

TEST_F(PipelineTest, UpAxesOnlyNameTheFrame) {
  const TriangleMesh source = Lopsided(), reference = testing::Capsule(1.0f, 0.3f);
  const auto y_up = pipeline_->Transfer(source, reference);
  // The same characters as a z-up program stores them: y -> z, z -> -y.
  const auto to_z_up = [](TriangleMesh mesh) {
    const Points p = mesh.positions;
    mesh.positions.col(1) = -p.col(2);
    mesh.positions.col(2) = p.col(1);
    return mesh;
  };
  const TriangleMesh z_source = to_z_up(source), z_reference = to_z_up(reference);
  const auto z_up =
      pipeline_->Transfer(z_source, z_reference, {.source_up = UpAxis::kZ, .reference_up = UpAxis::kZ});
  const auto mixed = pipeline_->Transfer(z_source, reference, {.source_up = UpAxis::kZ});
  ASSERT_TRUE(y_up.ok() && z_up.ok() && mixed.ok());
  const Points expected = to_z_up(y_up->target).positions;
  EXPECT_LT((z_up->target.positions - expected).cwiseAbs().maxCoeff(), 2e-3f);
  EXPECT_LT((mixed->target.positions - expected).cwiseAbs().maxCoeff(), 2e-3f);
  TriangleMesh joints;
  joints.positions = y_up->source_rig.joints;
  EXPECT_LT((z_up->source_rig.joints - to_z_up(joints).positions).cwiseAbs().maxCoeff(), 2e-3f);
}

TEST_F(PipelineTest, ABatchEqualsItsJobsAlone) {
  const TriangleMesh a = Lopsided(), b = testing::Icosphere(4), c = testing::Box(1, 2, 0.5f);
  const TransferJob jobs[] = {{&a, &b, {}}, {&b, &c, {}}, {&c, &a, {}}};
  const auto together = pipeline_->TransferBatch(jobs);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(together[i].ok());
    const auto alone = pipeline_->Transfer(*jobs[i].source, *jobs[i].reference);
    ASSERT_TRUE(alone.ok());
    EXPECT_LT((together[i]->target.positions - alone->target.positions).cwiseAbs().maxCoeff(), 2e-3f);
  }
}

TEST_F(PipelineTest, ABadJobLeavesItsNeighboursAlone) {
  const TriangleMesh good = Lopsided();
  TriangleMesh bad = good;
  bad.positions(7, 1) = std::numeric_limits<float>::quiet_NaN();
  TransferOptions wrong;
  wrong.smoothing.length = -1;
  const TransferJob jobs[] = {
      {&bad, &good, {}}, {&good, &good, {}}, {&good, &bad, {}}, {&good, &good, wrong}};
  const auto results = pipeline_->TransferBatch(jobs);
  EXPECT_EQ(results[0].status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(std::string(results[0].status().message()).starts_with("source: ")) << results[0].status();
  EXPECT_NE(std::string(results[0].status().message()).find("vertex 7"), std::string::npos);
  EXPECT_TRUE(results[1].ok()) << results[1].status();
  EXPECT_TRUE(std::string(results[2].status().message()).starts_with("reference: "));
  EXPECT_TRUE(std::string(results[3].status().message()).starts_with("options: smoothing.length: -1"));
}

// Given up at the first question, the second, ...: whenever it is, the job is cancelled, and its neighbour
// gets what it gets alone.
TEST_F(PipelineTest, AJobThatIsGivenUpStopsAtTheNextPhase) {
  const TriangleMesh mesh = Lopsided(), other = testing::Icosphere(3);
  std::atomic<int> asked = 0;
  int patience = std::numeric_limits<int>::max();
  const GivenUp given_up = [&] { return asked++ >= patience; };
  const TransferJob jobs[] = {{&mesh, &other, {}, given_up}, {&other, &mesh, {}}};
  const auto patient = pipeline_->TransferBatch(jobs);
  ASSERT_TRUE(patient[0].ok() && patient[1].ok());
  const int questions = asked;
  ASSERT_GE(questions, 5);
  for (patience = 0; patience < questions; ++patience) {
    SCOPED_TRACE(patience);
    asked = 0;
    const auto results = pipeline_->TransferBatch(jobs);
    EXPECT_EQ(results[0].status().code(), absl::StatusCode::kCancelled) << results[0].status();
    EXPECT_LE(asked, patience + 2);  // the source's and the reference's own
    ASSERT_TRUE(results[1].ok()) << results[1].status();
    EXPECT_LT((results[1]->target.positions - patient[1]->target.positions).cwiseAbs().maxCoeff(), 2e-3f);
  }
  const RigJob rig_jobs[] = {{&mesh, {}, [] { return true; }}, {&other, {}}};
  const auto rigs = pipeline_->RigBatch(rig_jobs);
  EXPECT_EQ(rigs[0].status().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(rigs[1].ok());
}

TEST_F(PipelineTest, TextureSeamsDoNotTear) {
  const TriangleMesh welded = Lopsided(), split = testing::Unwelded(welded);
  const auto result = pipeline_->Transfer(split, testing::Capsule());
  ASSERT_TRUE(result.ok());
  const auto smooth = pipeline_->Transfer(welded, testing::Capsule());
  ASSERT_TRUE(smooth.ok());
  ASSERT_EQ(result->target.vertex_count(), split.vertex_count());
  for (int64_t f = 0; f < split.face_count(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const Eigen::RowVector3f a = result->target.positions.row(split.faces(f, corner));
      const Eigen::RowVector3f b = smooth->target.positions.row(welded.faces(f, corner));
      ASSERT_LT((a - b).norm(), 5e-3f);
    }
  }
}

TEST_F(PipelineTest, UglyMeshesGiveFiniteTargetsAndWarnings) {
  for (const TriangleMesh& ugly : {testing::Fan(5), testing::WithDegenerateFaces(), testing::TwoSpheres(2)}) {
    const auto result = pipeline_->Transfer(ugly, Lopsided());
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_TRUE(result->target.positions.allFinite());
    EXPECT_FALSE(result->warnings.empty());
    EXPECT_TRUE(result->warnings[0].starts_with("source: "));
  }
}

TEST_F(PipelineTest, RigGivesJointsWeightsAndTimes) {
  const TriangleMesh mesh = Lopsided();
  const auto rig = pipeline_->RigMesh(mesh);
  ASSERT_TRUE(rig.ok());
  EXPECT_EQ(rig->rig.joints.rows(), kHumanJoints);
  EXPECT_EQ(rig->rig.weights.rows(), mesh.vertex_count());
  EXPECT_GT(rig->seconds.total, 0);
  const auto bad = pipeline_->RigMesh(TriangleMesh{});
  EXPECT_EQ(bad.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(std::string(bad.status().message()).starts_with("mesh: "));
}

TEST_F(PipelineTest, SaysWhatItLoaded) {
  ASSERT_EQ(pipeline_->models().size(), 1u);
  EXPECT_EQ(pipeline_->models()[0].name, "untrained");
  EXPECT_EQ(pipeline_->models()[0].parameter_count, 3'377'691);
}

}  // namespace
}  // namespace stance
