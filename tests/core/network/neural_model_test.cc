#include "core/network/neural_model.h"

#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/mesh/resample.h"
#include "core/network/skeletal_model.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class NeuralModelTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    files_ = std::make_unique<testing::UntrainedModel>(256, 2, kNeuralMethod);
    auto model = NeuralModel::Load(files_->dir());
    ASSERT_TRUE(model.ok()) << model.status();
    model_ = std::move(*model);
  }
  static void TearDownTestSuite() {
    model_.reset();
    files_.reset();
  }

  static NetworkInput InputOf(const TriangleMesh& mesh, int64_t samples) {
    SurfaceSamples surface = ResampleSurface(mesh, {samples, 12});
    return {std::move(surface.points), std::move(surface.one_ring)};
  }
  static NeuralRig RigOf(const NetworkInput& input) { return (*model_->Infer({&input, 1}, 1))[0]; }
  static NeuralCharacter CharacterOf(const NetworkInput& input) {
    const NeuralRig rig = RigOf(input);
    return {rig.features, rig.joints, NormalizationOf(input.points)};
  }

  static inline std::unique_ptr<testing::UntrainedModel> files_;
  static inline std::unique_ptr<NeuralModel> model_;
};

TEST_F(NeuralModelTest, LoadsWithItsManifestAndParameterCount) {
  EXPECT_EQ(model_->manifest().samples, 256);
  EXPECT_EQ(model_->manifest().method, kNeuralMethod);
  EXPECT_EQ(model_->parameter_count(), 3'377'691 + 2'484'675);
}

TEST_F(NeuralModelTest, BatchesOfAnySizesEqualSoloRunsAndWeightsSumToOne) {
  const std::vector<NetworkInput> inputs = {InputOf(testing::Capsule(), 256), InputOf(testing::Box(), 64),
                                            InputOf(testing::Icosphere(3), 128)};
  const auto together = model_->Infer(inputs, 2);
  ASSERT_TRUE(together.ok()) << together.status();
  for (size_t i = 0; i < inputs.size(); ++i) {
    const NeuralRig &a = (*together)[i], b = RigOf(inputs[i]);
    ASSERT_EQ(a.weights.rows(), inputs[i].points.rows());
    EXPECT_LT((a.weights - b.weights).cwiseAbs().maxCoeff(), 1e-3f);
    EXPECT_LT((a.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
    EXPECT_LT((a.joints - b.joints).cwiseAbs().maxCoeff(), 1e-3f);
    EXPECT_EQ(a.features.rows(), 24);
    EXPECT_LT((a.features - b.features).cwiseAbs().maxCoeff(), 1e-3f);
  }
}

// Whatever the reference's own place and size.
TEST_F(NeuralModelTest, ResultsMoveAndScaleWithTheSource) {
  const NetworkInput source = InputOf(testing::Capsule(), 256),
                     reference = InputOf(testing::Icosphere(3), 128);
  const auto moved = [](NetworkInput input, float scale) {
    input.points = (input.points * scale).rowwise() + Eigen::RowVector3f(4, 8, -16);
    return input;
  };
  const RowMatrix weights = RigOf(source).weights;
  const auto plain = model_->Deform(CharacterOf(source), CharacterOf(reference), source.points, weights, 1);
  const NetworkInput twice = moved(source, 2), half = moved(reference, 0.5f);
  const auto other = model_->Deform(CharacterOf(twice), CharacterOf(half), twice.points, weights, 1);
  ASSERT_TRUE(plain.ok() && other.ok());
  ASSERT_EQ(plain->rows(), 256);
  EXPECT_LT(((*plain * 2).rowwise() + Eigen::RowVector3f(4, 8, -16) - *other).cwiseAbs().maxCoeff(), 2e-2f);
}

TEST_F(NeuralModelTest, EachPointIsDecodedByItself) {
  const NetworkInput source = InputOf(testing::Capsule(), 256), reference = InputOf(testing::Box(), 64);
  const NeuralCharacter from = CharacterOf(source), to = CharacterOf(reference);
  const RowMatrix weights = RigOf(source).weights;
  const Points all = *model_->Deform(from, to, source.points, weights, 2);
  const Points some =
      *model_->Deform(from, to, source.points.middleRows(40, 9), weights.middleRows(40, 9), 1);
  EXPECT_LT((all.middleRows(40, 9) - some).cwiseAbs().maxCoeff(), 1e-4f);
  EXPECT_GT((all.row(0) - all.row(1)).norm(), 1e-3f);
}

TEST_F(NeuralModelTest, NothingInNothingOut) {
  EXPECT_TRUE(model_->Infer({}, 1)->empty());
  const NetworkInput input = InputOf(testing::Box(), 64);
  const NeuralCharacter character = CharacterOf(input);
  EXPECT_EQ(model_->Deform(character, character, Points(0, 3), RowMatrix(0, 24), 1)->rows(), 0);
}

TEST_F(NeuralModelTest, OtherMethodsModelsAndDamagedOnesAreRefused) {
  EXPECT_EQ(NeuralModel::Load("/nonexistent").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(NeuralModel::Load(testing::UntrainedModel(256).dir()).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(SkeletalModel::Load(files_->dir()).status().code(), absl::StatusCode::kInvalidArgument);
  const auto copy = std::filesystem::path(::testing::TempDir()) / "damaged_neural_model";
  std::filesystem::remove_all(copy);
  std::filesystem::copy(files_->dir(), copy);
  std::string bytes = *ReadFile(copy / "weights.safetensors");
  bytes.resize(bytes.size() / 2);
  ASSERT_TRUE(WriteFile(copy / "weights.safetensors", bytes).ok());
  EXPECT_EQ(NeuralModel::Load(copy).status().code(), absl::StatusCode::kDataLoss);
  std::filesystem::remove_all(copy);
}

}  // namespace
}  // namespace stance
