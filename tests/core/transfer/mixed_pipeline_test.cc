// A pipeline of several methods: which model answers, and what holds whichever it is. Random networks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <limits>

#include "core/transfer/pipeline.h"
#include "core/transfer/placement.h"
#include "core/transfer/up_axis.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using testing::UntrainedModel;

constexpr Method kMethods[] = {Method::kSkeletal, Method::kStance, Method::kNeural};
constexpr Method kSkinned[] = {Method::kSkeletal, Method::kStance};  // whose targets are skinned sources

class MixedPipelineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const UntrainedModel skeletal(256, 2), neural(256, 2, "neural"), stance(256, 2, "stance");
    auto pipeline = Pipeline::Load({skeletal.dir(), neural.dir(), stance.dir()}, {.threads = 2});
    ASSERT_TRUE(pipeline.ok()) << pipeline.status();
    pipeline_ = std::move(*pipeline);
  }
  static void TearDownTestSuite() { pipeline_.reset(); }

  static TransferResult Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                 const TransferOptions& options) {
    auto result = pipeline_->Transfer(source, reference, options);
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? *std::move(result) : TransferResult();
  }
  static inline std::unique_ptr<Pipeline> pipeline_;
};

TriangleMesh Lopsided() {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.2f, 24, 6, 20);
  mesh.positions.col(0) += 0.2f * mesh.positions.col(1).cwiseAbs2() + 0.1f * mesh.positions.col(2);
  return mesh;
}

// Stored as a program with that axis up does.
TriangleMesh Stored(TriangleMesh mesh, UpAxis up) {
  mesh.positions *= ToYUp(up);
  return mesh;
}

float Furthest(const TriangleMesh& a, const TriangleMesh& b) {
  return (a.positions - b.positions).cwiseAbs().maxCoeff();
}

TEST_F(MixedPipelineTest, StanceIsTheDefaultWhereverItStands) {
  ASSERT_EQ(pipeline_->models().size(), 3u);
  EXPECT_EQ(pipeline_->models()[0].method, Method::kStance);
  EXPECT_EQ(pipeline_->models()[1].method, Method::kSkeletal);
  EXPECT_EQ(pipeline_->models()[2].method, Method::kNeural);
  EXPECT_EQ(pipeline_->models()[0].name, "untrained-stance");
  EXPECT_TRUE(pipeline_->WarmUp().ok());
  const TriangleMesh source = Lopsided(), reference = testing::Capsule();
  EXPECT_LT(Furthest(Transfer(source, reference, {}).target,
                     Transfer(source, reference, {.method = Method::kStance}).target),
            1e-4f);
  EXPECT_GT(Furthest(Transfer(source, reference, {}).target,
                     Transfer(source, reference, {.method = Method::kSkeletal}).target),
            1e-2f);
}

TEST_F(MixedPipelineTest, ABatchOfAllEqualsItsJobsAlone) {
  const TriangleMesh a = Lopsided(), b = testing::Icosphere(4), c = testing::Box(1, 2, 0.5f);
  const TransferOptions skeletal{.method = Method::kSkeletal}, stance{.method = Method::kStance},
      neural{.method = Method::kNeural};
  const TransferJob jobs[] = {{&a, &b, stance},   {&b, &a, skeletal}, {&c, &a, {}},
                              {&a, &c, skeletal}, {&a, &b, {}},       {&b, &a, neural}};
  const auto together = pipeline_->TransferBatch(jobs);
  std::vector<RigJob> rigs;
  for (size_t i = 0; i < 6; ++i) {
    ASSERT_TRUE(together[i].ok()) << together[i].status();
    const TransferResult alone = Transfer(*jobs[i].source, *jobs[i].reference, jobs[i].options);
    // Ties for the last place among four weights are rounding's to decide: a few vertices of kNeural may
    // differ.
    const float most = jobs[i].options.method == Method::kNeural ? 0.1f : 2e-3f;
    EXPECT_LT(Furthest(together[i]->target, alone.target), most) << i;
    EXPECT_EQ(together[i]->model, alone.model);
    EXPECT_EQ(together[i]->confidence.has_value(), i % 2 == 0);
    rigs.push_back({jobs[i].source, jobs[i].options});
  }
  const auto rigged = pipeline_->RigBatch(rigs);
  for (size_t i = 0; i < 6; ++i) {
    ASSERT_TRUE(rigged[i].ok());
    EXPECT_LT((rigged[i]->rig.joints - together[i]->source_rig.joints).cwiseAbs().maxCoeff(), 2e-3f);
    EXPECT_EQ(rigged[i]->rig.confidence.size(), i % 2 == 0 ? kHumanJoints : 0);
  }
}

TEST_F(MixedPipelineTest, ABadJobLeavesBothMethodsNeighboursAlone) {
  const TriangleMesh good = Lopsided();
  TriangleMesh bad = good;
  bad.positions(7, 1) = std::numeric_limits<float>::quiet_NaN();
  const TransferOptions skeletal{.method = Method::kSkeletal};
  const TransferJob jobs[] = {
      {&bad, &good, {}}, {&good, &good, skeletal}, {&good, &good, {}}, {&good, &bad, skeletal}};
  const auto results = pipeline_->TransferBatch(jobs);
  EXPECT_EQ(results[0].status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(results[1].ok() && results[2].ok());
  EXPECT_EQ(results[3].status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(MixedPipelineTest, ConfidenceIsKnownToStanceAlone) {
  const TransferResult stance = Transfer(Lopsided(), testing::Box(), {});
  ASSERT_TRUE(stance.confidence.has_value());
  EXPECT_GE(*stance.confidence, 0);
  EXPECT_LE(*stance.confidence, 1);
  EXPECT_LE(*stance.confidence, stance.source_rig.confidence.maxCoeff());
  EXPECT_LE(*stance.confidence, stance.reference_rig.confidence.maxCoeff());
  const TransferResult skeletal = Transfer(Lopsided(), testing::Box(), {.method = Method::kSkeletal});
  EXPECT_FALSE(skeletal.confidence.has_value());
  EXPECT_EQ(skeletal.source_rig.confidence.size(), 0);
}

// Every combination of placement in every frame: target = LBS(transforms), and joints as the transforms say.
TEST_F(MixedPipelineTest, WhereverItIsPutTheTargetIsTheSkinnedSource) {
  for (const Method method : kSkinned) {
    for (const UpAxis up : {UpAxis::kY, UpAxis::kZ, UpAxis::kX}) {
      const TriangleMesh source = testing::WithAttributes(Stored(Lopsided(), up));
      const TransferResult result =
          Transfer(source, testing::Capsule(),
                   {.method = method, .source_up = up, .facing = Facing::kSource, .ground = Ground::kSource});
      for (int64_t v = 0; v < source.vertex_count(); v += 37) {
        Eigen::Vector3f expected = Eigen::Vector3f::Zero();
        for (int j = 0; j < kHumanJoints; ++j) {
          expected += result.source_rig.weights(v, j) * result.transforms[j].Apply(source.positions.row(v));
        }
        EXPECT_LT((result.target.positions.row(v).transpose() - expected).norm(), 1e-4f);
      }
      for (int j = 0; j < kHumanJoints; ++j) {
        const Eigen::Vector3f joint = result.transforms[j].Apply(result.source_rig.joints.row(j));
        EXPECT_LT((result.target_joints.row(j).transpose() - joint).norm(), 1e-5f);
      }
      EXPECT_LT((result.target.normals.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-3f);
    }
  }
}

TEST_F(MixedPipelineTest, GroundedTheTargetStandsAsLowAsTheSource) {
  for (const Method method : kMethods) {
    for (const UpAxis up : {UpAxis::kY, UpAxis::kZ, UpAxis::kX}) {
      const TriangleMesh source = Stored(Lopsided(), up);
      const Eigen::Vector3f axis = ToYUp(up).row(1).transpose();
      TransferOptions options{.method = method, .source_up = up};
      const TransferResult free = Transfer(source, testing::Icosphere(4), options);
      options.ground = Ground::kSource;
      const TransferResult put = Transfer(source, testing::Icosphere(4), options);
      EXPECT_NEAR(LowestHeight(put.target.positions, source.faces, axis),
                  LowestHeight(source.positions, source.faces, axis), 1e-5f);
      // Moved along the up axis and not otherwise.
      const Eigen::RowVector3f move = put.target.positions.row(0) - free.target.positions.row(0);
      EXPECT_LT((move - move.dot(axis) * axis.transpose()).norm(), 1e-4f);
      EXPECT_LT(((put.target.positions - free.target.positions).rowwise() - move).cwiseAbs().maxCoeff(),
                1e-4f);
    }
  }
}

TEST_F(MixedPipelineTest, FacingTheSourcesWayIsATurnAboutTheUpAxisThroughThePelvis) {
  for (const Method method : kMethods) {
    for (const UpAxis up : {UpAxis::kY, UpAxis::kZ}) {
      const TriangleMesh source = Stored(Lopsided(), up), reference = testing::Box(0.6f, 1.7f, 0.3f);
      TransferOptions options{.method = method, .source_up = up};
      const TransferResult plain = Transfer(source, reference, options);
      options.facing = Facing::kSource;
      const TransferResult turned = Transfer(source, reference, options);
      const Eigen::RowVector3f pelvis = plain.source_rig.joints.row(kPelvis);
      EXPECT_LT((turned.target_joints.row(kPelvis) - pelvis).norm(), 1e-4f);
      const Rotation turn = turned.transforms[kPelvis].linear * plain.transforms[kPelvis].linear.transpose();
      const Eigen::Vector3f axis = ToYUp(up).row(1).transpose();
      EXPECT_LT((turn * axis - axis).norm(), 1e-4f);
      const Points expected =
          ((plain.target.positions.rowwise() - pelvis) * turn.transpose()).rowwise() + pelvis;
      EXPECT_LT((turned.target.positions - expected).cwiseAbs().maxCoeff(), 2e-3f);
      // Heading is about y-up frames.
      Rig rig = turned.source_rig;
      rig.joints *= ToYUp(up).transpose();
      for (Rotation& rotation : rig.rotations) rotation = ToYUp(up) * rotation;
      const PelvisAxes axes = AxesOf(rig);
      const Rotation whole = ToYUp(up) * turned.transforms[kPelvis].linear * ToYUp(up).transpose();
      const Eigen::Vector3f target = Heading({whole * axes.forward, whole * axes.left, axes.lead});
      EXPECT_LT((target.normalized() - Heading(axes).normalized()).norm(), 1e-3f);
    }
  }
}

TEST_F(MixedPipelineTest, OwnPoseStaysWhereItIsWhateverThePlacement) {
  const TriangleMesh mesh = Lopsided();
  for (const Method method : kSkinned) {
    const TransferResult result =
        Transfer(mesh, mesh, {.method = method, .facing = Facing::kSource, .ground = Ground::kSource});
    EXPECT_LT(Furthest(result.target, mesh), 1e-3f);
  }
}

class LoadTest : public ::testing::Test {
 protected:
  static absl::Status Refused(const std::vector<std::filesystem::path>& folders) {
    return Pipeline::Load(folders).status();
  }
};

TEST_F(LoadTest, AFolderOfModelsLoadsAllInIt) {
  const UntrainedModel skeletal(128, 11), stance(128, 12, "stance");
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "stance_folder_of_models";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "notes");
  const auto copy = std::filesystem::copy_options::recursive;
  std::filesystem::copy(skeletal.dir(), folder / "a", copy);
  EXPECT_EQ((*Pipeline::Load(folder))->models().size(), 1u);
  std::filesystem::copy(stance.dir(), folder / "b", copy);
  const auto both = Pipeline::Load(folder);
  ASSERT_TRUE(both.ok()) << both.status();
  EXPECT_EQ((*both)->models().size(), 2u);
  std::filesystem::copy(stance.dir(), folder / "c", copy);
  const absl::Status twice = Refused({folder});
  EXPECT_EQ(twice.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(twice.message()), HasSubstr("a second model of the method 'stance'"));
  EXPECT_THAT(std::string(twice.message()), HasSubstr((folder / "c").string()));
  std::filesystem::remove_all(folder);
}

TEST_F(LoadTest, WithoutStanceTheFirstIsTheDefault) {
  const UntrainedModel skeletal(128, 13);
  const auto pipeline = Pipeline::Load({skeletal.dir()});
  ASSERT_TRUE(pipeline.ok());
  EXPECT_TRUE((*pipeline)->Transfer(Lopsided(), Lopsided()).ok());
  const absl::Status missing =
      (*pipeline)->Transfer(Lopsided(), Lopsided(), {.method = Method::kStance}).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(std::string(missing.message()), "options: method: 'stance' has no model here; loaded: skeletal");
}

TEST_F(LoadTest, NoModelIsAnErrorWithThePath) {
  EXPECT_EQ(Refused({}).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Refused({"/nonexistent"}).code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(Refused({"/nonexistent"}).message()), HasSubstr("/nonexistent"));
}

}  // namespace
}  // namespace stance
