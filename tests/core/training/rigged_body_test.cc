#include "core/training/rigged_body.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "core/skeleton/skeleton.h"
#include "core/training/mpfb_body.h"
#include "core/training/skinning.h"
#include "tests/core/training/small_data.h"
#include "tests/core/training/small_rig.h"

namespace stance {
namespace {

class RiggedBodyTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::TemporaryFolder folder;
    testing::WriteSmallBody(folder.path());
    auto body = ReadMpfbBody(folder.path());
    ASSERT_TRUE(body.ok()) << body.status();
    model_ = new BodyModel(std::make_shared<const BodyData>(*std::move(body)));
  }
  static void TearDownTestSuite() { delete model_; }

  static RestBody Neutral() { return model_->Shape({}, 0); }
  static RiggedBody Make(const RiggedMesh& mesh) {
    auto body = MakeRiggedBody(mesh, Neutral());
    EXPECT_TRUE(body.ok()) << body.status();
    return body.ok() ? *std::move(body) : RiggedBody{};
  }

  static BodyModel* model_;
};

BodyModel* RiggedBodyTest::model_ = nullptr;

TEST_F(RiggedBodyTest, RestsAsTheNeutralDoes) {
  const RiggedBody body = Make(testing::SmallRig());
  const RestBody neutral = Neutral();
  EXPECT_TRUE(CheckRiggedBody(body).ok());
  EXPECT_NEAR(body.rest.positions.col(1).minCoeff(), 0, 1e-4);
  EXPECT_NEAR(body.rest.positions.col(1).maxCoeff(), body.rest.stature, 1e-4);
  EXPECT_NEAR(body.rest.joints(kPelvis, 0), neutral.joints(kPelvis, 0), 1e-4);
  EXPECT_NEAR(body.rest.joints(kPelvis, 2), neutral.joints(kPelvis, 2), 1e-4);
  // The rig stands as the neutral's data do, so each bone must come to lie as the neutral's; the neutral's
  // morphs make some of them longer.
  for (int j = 1; j < kHumanJoints; ++j) {
    const int parent = HumanSkeleton().parents()[j];
    // This neutral's collars are not between neck and shoulder, where a rig's are put.
    if (parent == kSpine3 || parent == kLeftCollar || parent == kRightCollar) continue;
    const Eigen::RowVector3f bone = body.rest.joints.row(j) - body.rest.joints.row(parent);
    const Eigen::RowVector3f expected = neutral.joints.row(j) - neutral.joints.row(parent);
    EXPECT_LT((bone.normalized() - expected.normalized()).norm(), 0.017f) << HumanSkeleton().names()[j];
    EXPECT_NEAR(bone.norm() / expected.norm(), 1, 0.05);
  }
}

TEST_F(RiggedBodyTest, BoxesHangOnTheirJoints) {
  const RiggedBody body = Make(testing::SmallRig());
  EXPECT_LT((body.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-6f);
  const auto joint_of_box = [&body](Eigen::Index box) {
    Eigen::Index joint;
    EXPECT_EQ(body.weights.row(box * testing::kBoxVertices).maxCoeff(&joint), 1);
    return static_cast<int>(joint);
  };
  for (int j = 0; j < kHumanJoints; ++j) EXPECT_EQ(joint_of_box(j), j);
  EXPECT_EQ(joint_of_box(25), kHead);
  EXPECT_EQ(joint_of_box(27), kLeftWrist);
}

TEST_F(RiggedBodyTest, TheIdentityPoseIsTheRestPose) {
  const RiggedBody body = Make(testing::SmallRig());
  const std::vector<Rotation> still(kHumanJoints, Rotation::Identity());
  const auto transforms = PoseTransforms(HumanSkeleton(), body.rest.joints, still);
  EXPECT_LT(
      (SkinPoints(body.rest.positions, body.weights, transforms) - body.rest.positions).cwiseAbs().maxCoeff(),
      1e-5f);
}

TEST_F(RiggedBodyTest, AxesOfTheFileDoNotMatter) {
  const RiggedBody plain = Make(testing::SmallRig());
  const auto quarter = [](const Eigen::Vector3f& axis) {
    return Eigen::AngleAxisf(std::numbers::pi_v<float> / 2, axis).toRotationMatrix();
  };
  for (const Rotation& turn :
       {quarter(Eigen::Vector3f::UnitX()), quarter(Eigen::Vector3f::UnitY()),
        Rotation(quarter(Eigen::Vector3f::UnitZ()) * quarter(Eigen::Vector3f::UnitX()))}) {
    const RiggedBody turned = Make(testing::Turned(testing::SmallRig(), turn));
    EXPECT_LT((turned.rest.positions - plain.rest.positions).cwiseAbs().maxCoeff(), 2e-4f);
    EXPECT_LT((turned.rest.joints - plain.rest.joints).cwiseAbs().maxCoeff(), 1e-4f);
  }
}

TEST_F(RiggedBodyTest, ABodyAtRestNeedsNoRotation) {
  const RestBody neutral = Neutral();
  for (const Rotation& rotation : RestRotations(neutral.joints, neutral.joints)) {
    EXPECT_TRUE(rotation.isIdentity(1e-4f));
  }
}

TEST_F(RiggedBodyTest, UnfitCharactersAreRefused) {
  const auto code = [](const RiggedMesh& mesh) { return MakeRiggedBody(mesh, Neutral()).status().code(); };
  RiggedMesh small = testing::SmallRig();  // in centimetres, taken for metres
  small.positions *= 100;
  for (FileBone& bone : small.bones) bone.head *= 100;
  EXPECT_EQ(code(small), absl::StatusCode::kInvalidArgument);

  RiggedMesh exchanged = testing::SmallRig();
  for (FileBone& bone : exchanged.bones) {
    if (bone.name.ends_with("_l") || bone.name.ends_with("_r")) {
      bone.name.back() = bone.name.back() == 'l' ? 'r' : 'l';
    }
  }
  EXPECT_EQ(code(exchanged), absl::StatusCode::kInvalidArgument);

  RiggedMesh folded = testing::SmallRig();
  folded.bones[kNeck].head = folded.bones[kPelvis].head + Eigen::Vector3f(1, 0, 0);
  EXPECT_EQ(code(folded), absl::StatusCode::kInvalidArgument);

  RiggedMesh boneless = testing::SmallRig();
  boneless.bones.clear();
  EXPECT_EQ(code(boneless), absl::StatusCode::kInvalidArgument);
}

TEST_F(RiggedBodyTest, CheckNamesWhatIsWrong) {
  const RiggedBody good = Make(testing::SmallRig());
  const auto message = [](const RiggedBody& body) {
    const absl::Status status = CheckRiggedBody(body);
    return std::string(status.message());
  };
  RiggedBody bad = good;
  bad.faces(0, 0) = static_cast<int32_t>(bad.rest.positions.rows());
  EXPECT_NE(message(bad).find("face index"), std::string::npos);
  bad = good;
  bad.weights(3, 0) += 0.5f;
  EXPECT_NE(message(bad).find("weights"), std::string::npos);
  bad = good;
  bad.rest.joints.resize(3, 3);
  EXPECT_NE(message(bad).find("joints"), std::string::npos);
  for (const float place : {4.0f, std::numeric_limits<float>::quiet_NaN()}) {
    bad = good;
    bad.rest.positions(5, 0) = place;
    EXPECT_NE(message(bad).find("coordinate"), std::string::npos);
  }
  bad = good;
  bad.rest.stature = 30;
  EXPECT_NE(message(bad).find("30 m tall"), std::string::npos);
}

// The theorem that fixes the map: the neutral is where it is.
TEST_F(RiggedBodyTest, TheNeutralIsAtItsOwnPlaces) {
  RiggedBody body;
  body.rest = Neutral();
  body.weights = model_->weights(0);
  body.faces = model_->faces(0);
  const NeutralPlaces places(*model_);
  EXPECT_LT((places.Of(body) - model_->canonical(0)).cwiseAbs().maxCoeff(), 1e-4f);
  // At any size: places are those of a body, not of space.
  body.rest.positions *= 0.6f;
  body.rest.joints *= 0.6f;
  body.rest.stature *= 0.6;
  EXPECT_LT((places.Of(body) - model_->canonical(0)).cwiseAbs().maxCoeff(), 1e-4f);
}

}  // namespace
}  // namespace stance
