#include "core/training/body_model.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "core/skeleton/skeleton.h"
#include "core/training/mpfb_body.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

class BodyModelTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::TemporaryFolder folder;
    testing::WriteSmallBody(folder.path());
    auto body = ReadMpfbBody(folder.path());
    ASSERT_TRUE(body.ok()) << body.status();
    model_ = new BodyModel(std::make_shared<const BodyData>(*std::move(body)));
  }
  static void TearDownTestSuite() { delete model_; }

  static BodyModel* model_;
};

BodyModel* BodyModelTest::model_ = nullptr;

TEST_F(BodyModelTest, RestsInATPoseOnTheGround) {
  const RestBody rest = model_->Shape({}, 0);
  EXPECT_NEAR(rest.positions.col(1).minCoeff(), 0, 1e-4);
  EXPECT_NEAR(rest.positions.col(1).maxCoeff(), rest.stature, 1e-4);
  for (const int side : {0, 1}) {
    for (const int joint : {kLeftElbow + side, kLeftWrist + side, kLeftHand + side}) {
      const Eigen::RowVector3f bone =
          rest.joints.row(joint) - rest.joints.row(HumanSkeleton().parents()[joint]);
      EXPECT_NEAR(bone.normalized().x(), side == 0 ? 1 : -1, 1e-4);
    }
  }
}

TEST_F(BodyModelTest, StraighteningKeepsBoneLengths) {
  const RestBody rest = model_->Shape({}, 0);
  const Points a_pose = model_->data().points.middleRows(model_->data().vertex_count, kHumanJoints);
  // The neutral's own morphs move the joints by a few millimetres at most.
  for (int j = 1; j < kHumanJoints; ++j) {
    const int parent = HumanSkeleton().parents()[j];
    EXPECT_NEAR((rest.joints.row(j) - rest.joints.row(parent)).norm(),
                (a_pose.row(j) - a_pose.row(parent)).norm(),
                0.03 * (a_pose.row(j) - a_pose.row(parent)).norm() + 1e-4);
  }
}

TEST_F(BodyModelTest, LevelsAreSubsetsOfTheBody) {
  Random random(1);
  const ShapeParameters shape = RandomShape(random, model_->local_pairs());
  const RestBody whole = model_->Shape(shape, 0), coarse = model_->Shape(shape, 1);
  const std::vector<int32_t>& vertices = model_->data().levels[1].vertices;
  ASSERT_EQ(coarse.positions.rows(), static_cast<Eigen::Index>(vertices.size()));
  for (size_t i = 0; i < vertices.size(); ++i) {
    const auto v = static_cast<Eigen::Index>(i);
    EXPECT_LT((coarse.positions.row(v) - whole.positions.row(vertices[i])).norm(), 1e-6f);
    EXPECT_EQ(model_->weights(1).row(v), model_->weights(0).row(vertices[i]));
    EXPECT_EQ(model_->canonical(1).row(v), model_->canonical(0).row(vertices[i]));
  }
  EXPECT_EQ(coarse.joints, whole.joints);
  EXPECT_DOUBLE_EQ(coarse.stature, whole.stature);
}

TEST_F(BodyModelTest, NearestLevelByVertexCount) {
  EXPECT_EQ(model_->NearestLevel(0), 0);
  EXPECT_EQ(model_->NearestLevel(100000), 0);
  EXPECT_EQ(model_->NearestLevel(1500), 1);
  EXPECT_EQ(model_->NearestLevel(1), 1);
}

TEST_F(BodyModelTest, CanonicalCoordinatesAreTheNormalisedNeutral) {
  const Points& canonical = model_->canonical(0);
  const RestBody neutral = model_->Shape({}, 0);
  EXPECT_NEAR(canonical.col(1).maxCoeff() - canonical.col(1).minCoeff(), 1, 1e-4);
  EXPECT_TRUE((canonical.colwise().minCoeff() + canonical.colwise().maxCoeff()).isZero(1e-5f));
  const Points restored = canonical * static_cast<float>(neutral.stature);
  const Eigen::RowVector3f shift = neutral.positions.row(0) - restored.row(0);
  EXPECT_LT((neutral.positions - restored).rowwise().operator-(shift).cwiseAbs().maxCoeff(), 1e-5f);
}

TEST_F(BodyModelTest, MacroAndLocalMorphsActAsTheirFilesSay) {
  ShapeParameters tall, small;
  tall.height = 1;
  small.height = 0;
  const double neutral = model_->Shape({}, 0).stature;
  // The tall morph grows heights by 8 %, the small one shrinks them; at 0.5 half of each cancels.
  EXPECT_NEAR(model_->Shape(tall, 0).stature / neutral, 1.08, 0.003);
  EXPECT_NEAR(model_->Shape(small, 0).stature / neutral, 0.92, 0.003);

  ShapeParameters broad;
  broad.locals = {{1, 0.5}};  // the torso's pair: 10 % of x at amount 1, in every third vertex and the joints
  const RestBody base = model_->Shape({}, 0), wide = model_->Shape(broad, 0);
  EXPECT_NEAR(wide.joints(kLeftHip, 0), base.joints(kLeftHip, 0) + 0.5 * 0.1 * 0.1, 2e-4);
  broad.locals = {{1, -0.5}};
  EXPECT_NEAR(model_->Shape(broad, 0).joints(kLeftHip, 0), base.joints(kLeftHip, 0) - 0.5 * 0.1 * 0.1, 2e-4);
}

}  // namespace
}  // namespace stance
