// What must hold of METHOD_STANCE's shipped model, on the pair that is shipped.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "core/mesh/mesh_io.h"
#include "core/transfer/pipeline.h"

namespace stance {
namespace {

class BundledStanceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto pipeline = Pipeline::Load(STANCE_STANCE_MODEL_DIR, {.threads = 2});
    ASSERT_TRUE(pipeline.ok()) << pipeline.status();
    pipeline_ = std::move(*pipeline);
    source_ = *ReadMesh(std::filesystem::path(STANCE_SAMPLE_DIR) / "source.glb");
    reference_ = *ReadMesh(std::filesystem::path(STANCE_SAMPLE_DIR) / "reference.glb");
  }
  static void TearDownTestSuite() { pipeline_.reset(); }

  static inline std::unique_ptr<Pipeline> pipeline_;
  static inline TriangleMesh source_, reference_;
};

Rotation Turn(float degrees, const Eigen::Vector3f& axis) {
  return Eigen::AngleAxisf(degrees * std::numbers::pi_v<float> / 180, axis.normalized()).toRotationMatrix();
}

// People lie down, do handstands, and come from tools with another up axis.
TEST_F(BundledStanceTest, AReferenceThatIsTurnedAnyhowGivesTheTargetTurned) {
  const auto plain = pipeline_->Transfer(source_, reference_, {.method = Method::kStance});
  ASSERT_TRUE(plain.ok()) << plain.status();
  const Eigen::RowVector3f pelvis = plain->source_rig.joints.row(kPelvis);
  for (const Rotation& turn : {Turn(180, {1, 0, 0}), Turn(90, {0, 0, 1}), Turn(-90, {1, 0, 0}),
                               Turn(120, {1, 0, 1}), Turn(70, {0, 1, 0})}) {
    TriangleMesh turned = reference_;
    turned.positions *= turn.transpose();
    const auto result = pipeline_->Transfer(source_, turned, {.method = Method::kStance});
    ASSERT_TRUE(result.ok()) << result.status();
    const Points expected =
        ((plain->target.positions.rowwise() - pelvis) * turn.transpose()).rowwise() + pelvis;
    EXPECT_LT((result->target.positions - expected).rowwise().norm().mean(), 0.03f) << turn;
    EXPECT_GT(result->reference_rig.confidence.mean(), 0.7f) << turn;
  }
}

TEST_F(BundledStanceTest, OwnPoseLeavesTheMeshUnchanged) {
  const auto result = pipeline_->Transfer(reference_, reference_, {.method = Method::kStance});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_LT((result->target.positions - reference_.positions).rowwise().norm().maxCoeff(), 1e-4f);
}

}  // namespace
}  // namespace stance
