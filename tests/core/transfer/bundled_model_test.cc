// What must hold of the model that is shipped, on the pair that is shipped.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "core/base/random.h"
#include "core/mesh/mesh_io.h"
#include "core/mesh/resample.h"
#include "core/network/skeletal_model.h"
#include "core/transfer/pipeline.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

class BundledModelTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto pipeline = Pipeline::Load(STANCE_MODEL_DIR, {.threads = 2});
    ASSERT_TRUE(pipeline.ok()) << pipeline.status();
    pipeline_ = std::move(*pipeline);
    for (const auto& [mesh, file] :
         {std::pair{&source_, "source.glb"}, std::pair{&reference_, "reference.glb"}}) {
      auto read = ReadMesh(std::filesystem::path(STANCE_SAMPLE_DIR) / file);
      ASSERT_TRUE(read.ok()) << read.status();
      *mesh = *std::move(read);
    }
  }
  static void TearDownTestSuite() { pipeline_.reset(); }

  static inline std::unique_ptr<Pipeline> pipeline_;
  static inline TriangleMesh source_, reference_;
};

float LargestDistance(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

TEST_F(BundledModelTest, TheNetworksAreInvariantToTheOrderOfTheirPoints) {
  const auto model = SkeletalModel::Load(STANCE_MODEL_DIR);
  ASSERT_TRUE(model.ok()) << model.status();
  const SurfaceSamples samples =
      ResampleSurface(source_, {(*model)->manifest().samples, (*model)->manifest().max_ring});
  const int64_t n = samples.points.rows();
  std::vector<int32_t> order(n);  // row i of the shuffled input is row order[i]
  std::iota(order.begin(), order.end(), 0);
  Random random(3);
  for (int64_t i = n - 1; i > 0; --i) std::swap(order[i], order[random.Below(i + 1)]);
  std::vector<int32_t> place(n);
  for (int64_t i = 0; i < n; ++i) place[order[i]] = static_cast<int32_t>(i);
  NetworkInput inputs[2] = {{samples.points, samples.one_ring}, {samples.points, samples.one_ring}};
  for (int64_t i = 0; i < n; ++i) {
    inputs[1].points.row(i) = samples.points.row(order[i]);
    for (Eigen::Index r = 0; r < samples.one_ring.cols(); ++r) {
      inputs[1].one_ring(i, r) = place[samples.one_ring(order[i], r)];
    }
  }
  const auto predictions = (*model)->Infer(inputs, 1);
  ASSERT_TRUE(predictions.ok()) << predictions.status();
  const SkeletalPrediction &a = (*predictions)[0], &b = (*predictions)[1];
  EXPECT_LT(LargestDistance(a.joints, b.joints), 1e-3f);
  for (int64_t i = 0; i < n; ++i) {
    EXPECT_LT((a.confidence.row(order[i]) - b.confidence.row(i)).cwiseAbs().maxCoeff(), 1e-3f);
  }
}

TEST_F(BundledModelTest, TheOrderOfTheVerticesDoesNotMatter) {
  std::vector<int32_t> order;
  const TriangleMesh shuffled = testing::Shuffled(source_, 5, &order);
  const auto plain = pipeline_->Transfer(source_, reference_),
             mixed = pipeline_->Transfer(shuffled, reference_);
  ASSERT_TRUE(plain.ok()) << plain.status();
  ASSERT_TRUE(mixed.ok()) << mixed.status();
  Points sorted = mixed->target.positions;
  for (size_t v = 0; v < order.size(); ++v) {
    sorted.row(static_cast<int64_t>(v)) = mixed->target.positions.row(order[v]);
  }
  EXPECT_LT(LargestDistance(sorted, plain->target.positions), 1e-3f);
}

TEST_F(BundledModelTest, OwnPoseLeavesTheMeshUnchanged) {
  const auto result = pipeline_->Transfer(reference_, reference_);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_LT(LargestDistance(result->target.positions, reference_.positions), 1e-4f);
}

// The bones of the target point where the reference's do: head up, feet and hands where they are.
TEST_F(BundledModelTest, TheTargetTakesTheReferencesBoneDirections) {
  const auto result = pipeline_->Transfer(source_, reference_, {.twist = Twist::kInherited});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->target.positions.allFinite());
  const Skeleton& skeleton = pipeline_->skeleton();
  for (int j = 1; j < skeleton.joint_count(); ++j) {
    const int parent = skeleton.parents()[j];
    if (skeleton.children(parent).size() != 1) continue;
    const Eigen::RowVector3f target = result->target_joints.row(j) - result->target_joints.row(parent);
    const Eigen::RowVector3f wanted =
        result->reference_rig.joints.row(j) - result->reference_rig.joints.row(parent);
    EXPECT_GT(target.normalized().dot(wanted.normalized()), 0.999f) << skeleton.names()[j];
  }
}

// However the reference stands about the up axis. Nearly, since the networks see another input.
TEST_F(BundledModelTest, FacingTheSourcesWayForgetsTheReferencesYaw) {
  const TransferOptions options{
      .twist = Twist::kInherited, .facing = Facing::kSource, .ground = Ground::kSource};
  const auto plain = pipeline_->Transfer(source_, reference_, options);
  ASSERT_TRUE(plain.ok()) << plain.status();
  for (const float yaw : {0.9f, 2.5f}) {
    TriangleMesh turned = reference_;
    turned.positions *= Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitY()).toRotationMatrix().transpose();
    const auto result = pipeline_->Transfer(source_, turned, options);
    ASSERT_TRUE(result.ok()) << result.status();
    const Points difference = result->target.positions - plain->target.positions;
    EXPECT_LT(difference.rowwise().norm().mean(), 0.06f) << yaw;  // the networks' own error is some 3 cm
    EXPECT_NEAR(result->target.positions.col(1).minCoeff(), source_.positions.col(1).minCoeff(), 1e-5f);
  }
}

}  // namespace
}  // namespace stance
