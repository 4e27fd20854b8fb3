// The pipeline of METHOD_NEURAL: the properties that hold for any networks, random ones here.
#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "core/transfer/pipeline.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class NeuralPipelineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::UntrainedModel files(256, 2, "neural");
    auto pipeline = Pipeline::Load(files.dir(), {.threads = 2});
    ASSERT_TRUE(pipeline.ok()) << pipeline.status();
    pipeline_ = std::move(*pipeline);
  }
  static void TearDownTestSuite() { pipeline_.reset(); }

  static TransferResult Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                 const TransferOptions& options = {}) {
    auto result = pipeline_->Transfer(source, reference, options);
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? *std::move(result) : TransferResult();
  }
  static inline std::unique_ptr<Pipeline> pipeline_;
};

TriangleMesh Lopsided(int tubes = 20) {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.2f, 24, 6, tubes);
  mesh.positions.col(0) += 0.2f * mesh.positions.col(1).cwiseAbs2() + 0.1f * mesh.positions.col(2);
  return mesh;
}

// In the mean: the weights of a sample jump where two joints tie for the last place among the four that stay,
// and rounding decides there.
float Apart(const Points& a, const Points& b) { return (a - b).rowwise().norm().mean(); }

TEST_F(NeuralPipelineTest, SaysWhatItIs) {
  ASSERT_EQ(pipeline_->models().size(), 1u);
  EXPECT_EQ(pipeline_->models()[0].method, Method::kNeural);
  EXPECT_EQ(pipeline_->models()[0].name, "untrained-neural");
  EXPECT_EQ(pipeline_->models()[0].parameter_count, 5'862'366);
  EXPECT_TRUE(pipeline_->WarmUp().ok());
}

TEST_F(NeuralPipelineTest, HasNoFullResolution) {
  const testing::UntrainedModel files(256, 3, "neural");
  const absl::Status status = Pipeline::Load(files.dir(), {.threads = 1, .full_resolution = true}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(std::string(status.message()), "full_resolution: the method 'neural' has none");
}

TEST_F(NeuralPipelineTest, AnswersHaveTheirShapesAndNoConfidence) {
  for (const TriangleMesh& reference : {testing::Box(), testing::Fan(4), testing::TwoSpheres(3)}) {
    const TriangleMesh source = testing::WithAttributes(Lopsided());
    const TransferResult result = Transfer(source, reference, {.reference_weights = true});
    EXPECT_EQ(result.target.vertex_count(), source.vertex_count());
    EXPECT_EQ(result.target.faces, source.faces);
    EXPECT_TRUE(result.target.positions.allFinite());
    EXPECT_FALSE(result.confidence.has_value());
    EXPECT_EQ(result.transforms.size(), static_cast<size_t>(kHumanJoints));
    EXPECT_LT((result.target_joints.row(kPelvis) - result.source_rig.joints.row(kPelvis)).norm(), 1e-5f);
    for (const Rig* rig : {&result.source_rig, &result.reference_rig}) {
      EXPECT_GE(rig->weights.minCoeff(), 0);
      EXPECT_LT((rig->weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
      EXPECT_LE((rig->weights.array() > 0).rowwise().count().maxCoeff(), 4);
    }
  }
}

TEST_F(NeuralPipelineTest, ABatchGivesWhatEachPairGivesAlone) {
  const TriangleMesh a = Lopsided(), b = testing::Icosphere(4), c = testing::Capsule();
  const std::vector<TransferJob> jobs = {{&a, &b, {}}, {&c, &a, {}}, {&b, &c, {}}};
  const auto results = pipeline_->TransferBatch(jobs);
  for (size_t i = 0; i < jobs.size(); ++i) {
    ASSERT_TRUE(results[i].ok()) << results[i].status();
    const TransferResult alone = Transfer(*jobs[i].source, *jobs[i].reference);
    EXPECT_LT(Apart(results[i]->target.positions, alone.target.positions), 2e-3f) << i;
  }
}

TEST_F(NeuralPipelineTest, ThePoseDependsOnTheReference) {
  const TriangleMesh source = Lopsided();
  const Points one = Transfer(source, testing::Box()).target.positions,
               two = Transfer(source, testing::Icosphere(3)).target.positions;
  EXPECT_GT((one - two).rowwise().norm().maxCoeff(), 1e-3f);
}

// Few vertices or many: each is decoded by itself.
TEST_F(NeuralPipelineTest, AnyVertexCountWillDo) {
  for (const int tubes : {1, 20, 200}) {
    const TriangleMesh source = Lopsided(tubes);
    EXPECT_EQ(Transfer(source, testing::Box()).target.vertex_count(), source.vertex_count());
  }
}

TEST_F(NeuralPipelineTest, TheOrderOfTheVerticesIsTheTargets) {
  std::vector<int32_t> order;
  const TriangleMesh source = Lopsided(), shuffled = testing::Shuffled(source, 4, &order);
  const Points plain = Transfer(source, testing::Box()).target.positions,
               other = Transfer(shuffled, testing::Box()).target.positions;
  Points back(plain.rows(), 3);
  for (int64_t v = 0; v < plain.rows(); ++v) back.row(v) = other.row(order[v]);
  EXPECT_LT(Apart(back, plain), 2e-3f);
}

// What lies together stays together, to the bit.
TEST_F(NeuralPipelineTest, SeamsStayClosed) {
  const TriangleMesh source = testing::Unwelded(Lopsided());
  const Points target = Transfer(source, testing::Box()).target.positions;
  std::map<std::tuple<float, float, float>, int64_t> first;
  for (int64_t v = 0; v < source.vertex_count(); ++v) {
    const auto place = std::tuple(source.positions(v, 0), source.positions(v, 1), source.positions(v, 2));
    EXPECT_EQ(target.row(v), target.row(first.emplace(place, v).first->second));
  }
  EXPECT_LT(first.size(), static_cast<size_t>(source.vertex_count()));
}

TEST_F(NeuralPipelineTest, TheUpAxisTurnsTheAnswerAndNothingElse) {
  const TriangleMesh source = Lopsided(), reference = testing::Capsule();
  TriangleMesh turned = source;
  for (int64_t v = 0; v < turned.vertex_count(); ++v) {  // x, y, z of y up are x, -z, y of z up
    turned.positions.row(v) << source.positions(v, 0), -source.positions(v, 2), source.positions(v, 1);
  }
  const TransferResult plain = Transfer(source, reference),
                       result = Transfer(turned, reference, {.source_up = UpAxis::kZ});
  for (const auto& [turned_back, expected] : {std::pair{&result.target.positions, &plain.target.positions},
                                              std::pair{&result.target_joints, &plain.target_joints}}) {
    Points back = *turned_back;
    back.col(1) = turned_back->col(2);
    back.col(2) = -turned_back->col(1);
    EXPECT_LT(Apart(back, *expected), 2e-3f);
  }
}

TEST_F(NeuralPipelineTest, RigsMeshes) {
  const auto rig = pipeline_->RigMesh(Lopsided());
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->model, "untrained-neural");
  EXPECT_EQ(rig->rig.joints.rows(), kHumanJoints);
  EXPECT_EQ(rig->rig.weights.rows(), Lopsided().vertex_count());
  EXPECT_TRUE(rig->rig.rotations.empty());
}

}  // namespace
}  // namespace stance
