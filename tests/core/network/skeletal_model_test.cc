#include "core/network/skeletal_model.h"

#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/mesh/resample.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class SkeletalModelTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { files_ = std::make_unique<testing::UntrainedModel>(256); }
  static void TearDownTestSuite() { files_.reset(); }

  static NetworkInput InputOf(const TriangleMesh& mesh, int64_t samples) {
    SurfaceSamples s = ResampleSurface(mesh, {samples, 12});
    return {s.points, s.one_ring};
  }
  static inline std::unique_ptr<testing::UntrainedModel> files_;
};

TEST_F(SkeletalModelTest, LoadsWithItsManifestAndParameterCount) {
  const auto model = SkeletalModel::Load(files_->dir());
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ((*model)->manifest().samples, 256);
  EXPECT_EQ((*model)->parameter_count(), 3'377'691);
}

TEST_F(SkeletalModelTest, BatchesOfAnySizesEqualSoloRunsAndConfidencesSumToOne) {
  const auto model = SkeletalModel::Load(files_->dir());
  ASSERT_TRUE(model.ok());
  const std::vector<NetworkInput> inputs = {InputOf(testing::Capsule(), 256), InputOf(testing::Box(), 64),
                                            InputOf(testing::Icosphere(3), 128)};
  const auto together = (*model)->Infer(inputs, 2);
  ASSERT_TRUE(together.ok()) << together.status();
  for (size_t i = 0; i < inputs.size(); ++i) {
    const auto alone = (*model)->Infer({&inputs[i], 1}, 1);
    ASSERT_TRUE(alone.ok());
    const SkeletalPrediction &a = (*together)[i], &b = (*alone)[0];
    EXPECT_EQ(static_cast<int64_t>(a.joint_of.size()), inputs[i].points.rows());
    EXPECT_LT((a.confidence - b.confidence).cwiseAbs().maxCoeff(), 1e-4f);
    EXPECT_LT((a.confidence.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
    ASSERT_EQ(a.joints.rows(), 24);
    if (a.joint_of == b.joint_of) {
      EXPECT_LT((a.joints - b.joints).cwiseAbs().maxCoeff(), 1e-3f);
    }
  }
}

TEST_F(SkeletalModelTest, JointsMoveAndScaleWithTheInput) {
  const auto model = SkeletalModel::Load(files_->dir());
  ASSERT_TRUE(model.ok());
  NetworkInput input = InputOf(testing::Capsule(), 256);
  const Points before = (*(*model)->Infer({&input, 1}, 1))[0].joints;
  input.points = (input.points * 2).rowwise() + Eigen::RowVector3f(4, 8, -16);
  const Points after = (*(*model)->Infer({&input, 1}, 1))[0].joints;
  EXPECT_LT(((before * 2).rowwise() + Eigen::RowVector3f(4, 8, -16) - after).cwiseAbs().maxCoeff(), 1e-2f);
}

TEST_F(SkeletalModelTest, NoInputGivesNoPrediction) {
  const auto model = SkeletalModel::Load(files_->dir());
  ASSERT_TRUE(model.ok());
  EXPECT_TRUE((*model)->Infer({}, 1)->empty());
}

TEST_F(SkeletalModelTest, ADamagedOrMissingModelIsRefused) {
  EXPECT_EQ(SkeletalModel::Load("/nonexistent").status().code(), absl::StatusCode::kNotFound);
  const auto copy = std::filesystem::path(::testing::TempDir()) / "damaged_model";
  std::filesystem::remove_all(copy);
  std::filesystem::copy(files_->dir(), copy);
  std::string bytes = *ReadFile(copy / "weights.safetensors");
  bytes.resize(bytes.size() / 2);
  ASSERT_TRUE(WriteFile(copy / "weights.safetensors", bytes).ok());
  EXPECT_EQ(SkeletalModel::Load(copy).status().code(), absl::StatusCode::kDataLoss);
  std::filesystem::remove_all(copy);
}

}  // namespace
}  // namespace stance
