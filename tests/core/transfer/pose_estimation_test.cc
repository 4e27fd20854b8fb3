// For any networks, random ones here.
#include "core/transfer/pose_estimation.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/mesh/resample.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class EstimatePosesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    model_ = *PoseModel::Load(testing::UntrainedModel(128, 2, kStanceMethod).dir());
    for (const TriangleMesh& mesh : {testing::Capsule(), testing::Box(), testing::TwoSpheres(3)}) {
      Samplings samplings;
      for (const SurfaceSamples& samples : ResampleSurfaceRepeatedly(mesh, 3, {128, 12})) {
        samplings.push_back(MakePyramidInput(samples, 1));
      }
      ASSERT_EQ(samplings.size(), 3u);
      meshes_.push_back(std::move(samplings));
    }
  }
  static void TearDownTestSuite() { model_.reset(); }

  static std::vector<PoseEstimate> Estimate(std::span<const Samplings> meshes,
                                            const PoseEstimationOptions& options = {}) {
    auto estimates = EstimatePoses(*model_, meshes, /*threads=*/1, options);
    EXPECT_TRUE(estimates.ok()) << estimates.status();
    return *std::move(estimates);
  }

  static inline std::unique_ptr<PoseModel> model_;
  static inline std::vector<Samplings> meshes_;
};

TEST_F(EstimatePosesTest, AreProper) {
  for (const PoseEstimate& estimate : Estimate(meshes_)) {
    EXPECT_EQ(estimate.weights.rows(), 3 * 128);
    EXPECT_EQ(estimate.canonical.rows(), 3 * 128);
    EXPECT_TRUE(estimate.joints.allFinite());
    EXPECT_LT((estimate.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
    EXPECT_GE(estimate.confidence.minCoeff(), 0);
    EXPECT_LE(estimate.confidence.maxCoeff(), 1);
    for (const Rotation& rotation : estimate.rotations) {
      EXPECT_LT((rotation * rotation.transpose() - Rotation::Identity()).norm(), 1e-5f);
      EXPECT_NEAR(rotation.determinant(), 1, 1e-5f);
    }
  }
}

TEST_F(EstimatePosesTest, NeighboursInABatchDoNotMatter) {
  const std::vector<PoseEstimate> together = Estimate(meshes_);
  for (size_t i = 0; i < meshes_.size(); ++i) {
    const PoseEstimate alone = Estimate(std::span(meshes_).subspan(i, 1))[0];
    // Products of other sizes round differently, and the second network sees what the first has rounded.
    EXPECT_LT((alone.joints - together[i].joints).cwiseAbs().maxCoeff(), 2e-3f);
    EXPECT_LT((alone.weights - together[i].weights).cwiseAbs().maxCoeff(), 2e-3f);
  }
}

TEST_F(EstimatePosesTest, AreMeansOverSamplings) {
  const PoseEstimationOptions once = {
      .views = 2, .refinement_views = 0, .least_confidence = 0, .joint_stiffness = 0};
  const PoseEstimationOptions twice = {
      .views = 1, .refinement_views = 0, .least_confidence = 0, .joint_stiffness = 0};
  const Samplings& mesh = meshes_[0];
  // The same sampling twice, in one of two views each, is one sampling in both.
  const std::vector<Samplings> one = {{mesh[0]}}, same = {{mesh[0], mesh[0]}};
  const PoseEstimate views = Estimate(one, once)[0], joined = Estimate(same, twice)[0];
  EXPECT_LT((views.joints - joined.joints).cwiseAbs().maxCoeff(), 1e-4f);
  EXPECT_LT((views.bones - joined.bones).cwiseAbs().maxCoeff(), 1e-4f);
  EXPECT_LT((views.confidence - joined.confidence).cwiseAbs().maxCoeff(), 1e-4f);
  ASSERT_EQ(joined.weights.rows(), 2 * views.weights.rows());
  const RowMatrix mean =
      (joined.weights.topRows(views.weights.rows()) + joined.weights.bottomRows(views.weights.rows())) / 2;
  EXPECT_LT((views.weights - mean).cwiseAbs().maxCoeff(), 1e-4f);
}

// Looks at other sides are taken only by those who are not sure, and never make one less sure.
TEST_F(EstimatePosesTest, TheSurestSideCounts) {
  const PoseEstimationOptions upright = {.refinement_views = 0, .least_confidence = 0};
  const PoseEstimationOptions anyhow = {.refinement_views = 0, .least_confidence = 1};
  const std::vector<PoseEstimate> before = Estimate(meshes_, upright), after = Estimate(meshes_, anyhow);
  int turned = 0;
  for (size_t i = 0; i < meshes_.size(); ++i) {
    EXPECT_GE(after[i].confidence.mean(), before[i].confidence.mean());
    turned += after[i].confidence != before[i].confidence;
    const float mean = before[i].confidence.mean();
    const PoseEstimationOptions sure = {.refinement_views = 0, .least_confidence = mean - 0.01f};
    EXPECT_EQ(Estimate(std::span(meshes_).subspan(i, 1), sure)[0].confidence,
              Estimate(std::span(meshes_).subspan(i, 1), upright)[0].confidence);
  }
  EXPECT_GT(turned, 0);  // else this test says nothing
}

TEST_F(EstimatePosesTest, TheSecondLookIsTakenWhereTheModelHasOne) {
  ASSERT_TRUE(model_->refines());
  const PoseEstimationOptions once = {.refinement_views = 0};
  const PoseEstimate first = Estimate(meshes_, once)[0], refined = Estimate(meshes_)[0];
  EXPECT_GT((refined.joints - first.joints).norm(), 1e-3f);

  const std::filesystem::path dir = std::filesystem::path(::testing::TempDir()) / "unrefined";
  ModelManifest manifest = model_->manifest();
  ASSERT_TRUE(PoseModel::WriteUntrained(dir, 2, manifest, /*refines=*/false).ok());
  const auto unrefined = PoseModel::Load(dir);
  ASSERT_TRUE(unrefined.ok()) << unrefined.status();
  EXPECT_FALSE((*unrefined)->refines());
  EXPECT_LT((*unrefined)->parameter_count(), model_->parameter_count());
  // Of the same seed, so that the first network is the same.
  const auto found = EstimatePoses(**unrefined, meshes_, 1);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ((*found)[0].joints, first.joints);
}

}  // namespace
}  // namespace stance
