#include "core/transfer/self_test.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <limits>

#include "core/base/files.h"
#include "core/network/model_digests.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::UntrainedModel;

absl::Status TestOf(const fs::path& dir, std::vector<std::string>* untested = nullptr) {
  const auto pipeline = Pipeline::Load(dir);
  if (!pipeline.ok()) return pipeline.status();
  std::vector<std::string> missing;
  const absl::Status status = RunSelfTests(**pipeline, {dir}, missing);
  if (untested != nullptr) *untested = missing;
  return status;
}

void Replace(const fs::path& path, const std::string& from, const std::string& to) {
  std::string text = ReadFile(path).value();
  ASSERT_NE(text.find(from), std::string::npos) << from;
  ASSERT_TRUE(WriteFile(path, text.replace(text.find(from), from.size(), to)).ok());
}

class SelfTestTest : public ::testing::TestWithParam<const char*> {
 protected:
  const UntrainedModel model_{256, 2, GetParam()};
  const fs::path dir_ = model_.dir();
};

INSTANTIATE_TEST_SUITE_P(Methods, SelfTestTest, ::testing::Values("skeletal", "stance"));

TEST_P(SelfTestTest, AModelPassesItsOwnAndAnotherFailsIt) {
  ASSERT_TRUE(WriteSelfTest(dir_, testing::Capsule()).ok());
  std::vector<std::string> untested;
  EXPECT_TRUE(TestOf(dir_, &untested).ok()) << TestOf(dir_);
  EXPECT_THAT(untested, IsEmpty());
  const UntrainedModel other(256, 3, GetParam());
  fs::copy(dir_ / kSelfTestFile, other.dir() / kSelfTestFile);
  const absl::Status refused = TestOf(other.dir());
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr(other.dir().string() + ": self-test: "));
}

TEST_P(SelfTestTest, AModelWithoutOneIsNamed) {
  std::vector<std::string> untested;
  EXPECT_TRUE(TestOf(dir_, &untested).ok());
  EXPECT_THAT(untested, ElementsAre(dir_.string()));
}

TEST_P(SelfTestTest, WritingItTwiceChangesNothing) {
  ASSERT_TRUE(WriteSelfTest(dir_, testing::Capsule()).ok());
  const std::string manifest = ReadFile(dir_ / "manifest.json").value();
  ASSERT_TRUE(WriteSelfTest(dir_, testing::Capsule()).ok());
  EXPECT_EQ(ReadFile(dir_ / "manifest.json").value(), manifest);
  EXPECT_THAT(manifest, HasSubstr("\"self_test.json\""));
  EXPECT_THAT(manifest, HasSubstr("\"weights.safetensors\""));
}

TEST_P(SelfTestTest, ItsDigestIsCheckedBeforeItRuns) {
  ASSERT_TRUE(WriteSelfTest(dir_, testing::Capsule()).ok());
  Replace(dir_ / kSelfTestFile, "\"format_version\":1", "\"format_version\":2");
  const absl::Status damaged = TestOf(dir_);
  EXPECT_EQ(damaged.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(damaged.message()), HasSubstr("self_test.json: sha256 is"));
  ASSERT_TRUE(WriteDigests(dir_, {kSelfTestFile}).ok());
  EXPECT_THAT(std::string(TestOf(dir_).message()), HasSubstr("self_test.json: format_version is not 1"));
}

TEST_P(SelfTestTest, WeightsOfAnotherDigestAreRefused) {
  ASSERT_TRUE(WriteSelfTest(dir_, testing::Capsule()).ok());
  const std::string manifest = ReadFile(dir_ / "manifest.json").value();
  const size_t digest = manifest.find("weights.safetensors\": \"") + 23;
  Replace(dir_ / "manifest.json", manifest.substr(digest, 64), std::string(64, '0'));
  const absl::Status refused = TestOf(dir_);
  EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("weights.safetensors: sha256 is"));
}

TEST(CompareWithSelfTestTest, JointsAndRotationsHaveTolerances) {
  SelfTest test;
  test.joints = Points::Zero(2, 3);
  test.rotations.assign(2, Rotation::Identity());
  test.joint_tolerance = 0.1;
  test.rotation_tolerance = 0.2;
  Rig rig;
  rig.joints = Points::Constant(2, 3, 0.05f);
  const auto turn = [](float angle) { return Rotation(Eigen::AngleAxisf(angle, Eigen::Vector3f::UnitX())); };
  rig.rotations = {turn(0.19f), turn(-0.19f)};
  EXPECT_TRUE(CompareWithSelfTest(test, rig).ok());
  rig.rotations[1] = turn(0.21f);
  EXPECT_THAT(std::string(CompareWithSelfTest(test, rig).message()), HasSubstr("rotation of joint 1"));
  rig.joints(0, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(std::string(CompareWithSelfTest(test, rig).message()), HasSubstr("joint 0 is off by nan"));
  rig.rotations.pop_back();
  EXPECT_THAT(std::string(CompareWithSelfTest(test, rig).message()), HasSubstr("2 joints and 1 rotations"));
}

// Each shipped model, whatever noise another processor's rounding makes: its sample moved by a hundredth of a
// millimetre, which is far more than that.
TEST(ShippedSelfTest, HoldsUnderRounding) {
  for (const char* dir : {STANCE_MODEL_DIR, STANCE_STANCE_MODEL_DIR}) {
    SCOPED_TRACE(dir);
    EXPECT_TRUE(TestOf(dir).ok()) << TestOf(dir);
    const auto test = ReadSelfTest(dir);
    ASSERT_TRUE(test.ok()) << test.status();
    EXPECT_LT(test->joint_tolerance, 0.15) << "metres of a body: more says nothing";
    EXPECT_LT(fs::file_size(fs::path(dir) / kSelfTestFile), 50'000u);
    const auto pipeline = Pipeline::Load(dir);
    ASSERT_TRUE(pipeline.ok()) << pipeline.status();
    for (const uint32_t seed : {1u, 2u, 3u}) {
      std::srand(seed);  // Eigen's source of random numbers
      TriangleMesh noisy = test->mesh;
      noisy.positions += 1e-5f * Points::Random(noisy.vertex_count(), 3);
      const auto rig = (*pipeline)->RigMesh(noisy);
      ASSERT_TRUE(rig.ok()) << rig.status();
      EXPECT_TRUE(CompareWithSelfTest(*test, rig->rig).ok()) << CompareWithSelfTest(*test, rig->rig);
    }
  }
}

}  // namespace
}  // namespace stance
