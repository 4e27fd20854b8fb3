// The generator with rigged characters beside the parametric body.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>

#include "core/base/files.h"
#include "core/mesh/measure.h"
#include "core/mesh/resample.h"
#include "core/training/character_generator.h"
#include "core/training/character_pack.h"
#include "core/training/mpfb_body.h"
#include "tests/core/training/small_data.h"
#include "tests/core/training/small_rig.h"

namespace stance {
namespace {

using Generator = std::unique_ptr<CharacterGenerator>;

// Eight rigged characters of different sizes, three of them held out, where `rigged`.
Generator SmallGenerator(bool rigged) {
  const testing::TemporaryFolder folder;
  testing::WriteSmallBody(folder.path() / "mpfb");
  testing::WriteSmallMotions(folder.path() / "bvh", 20);
  const auto plain = CharacterGenerator::FromData(folder.path() / "mpfb", folder.path() / "bvh");
  const auto path = folder.path() / "humans.pack";
  EXPECT_TRUE(plain.ok() && (*plain)->WritePack(path).ok());
  auto pack = ParsePack(*ReadFile(path));
  EXPECT_TRUE(pack.ok()) << pack.status();
  const RestBody neutral = BodyModel(std::make_shared<const BodyData>(pack->body)).Shape({}, 0);
  for (int i = 0; rigged && i < 8; ++i) {
    RiggedMesh mesh = testing::SmallRig();
    const float size = 0.8f + 0.05f * static_cast<float>(i);
    mesh.positions *= size;
    for (FileBone& bone : mesh.bones) bone.head *= size;
    auto body = MakeRiggedBody(mesh, neutral);
    EXPECT_TRUE(body.ok()) << body.status();
    body->name = fmt::format("people/{}", i);
    body->held_out = i % 3 == 1;
    pack->rigged.push_back(*std::move(body));
  }
  EXPECT_TRUE(WriteFile(path, SerializePack(*pack)).ok());
  auto generator = CharacterGenerator::FromPack(path);
  EXPECT_TRUE(generator.ok()) << generator.status();
  return *std::move(generator);
}

class RiggedGeneratorTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    plain_ = SmallGenerator(false);
    rigged_ = SmallGenerator(true);
  }
  static void TearDownTestSuite() {
    plain_.reset();
    rigged_.reset();
  }
  static Generator plain_, rigged_;
};

Generator RiggedGeneratorTest::plain_, RiggedGeneratorTest::rigged_;

constexpr int kRigVertices = 29 * testing::kBoxVertices;

TEST_F(RiggedGeneratorTest, SplitsAreDisjointByName) {
  EXPECT_EQ(rigged_->RiggedNames(Split::kTrain),
            (std::vector<std::string>{"people/0", "people/2", "people/3", "people/5", "people/6"}));
  EXPECT_EQ(rigged_->RiggedNames(Split::kTest),
            (std::vector<std::string>{"people/1", "people/4", "people/7"}));
  EXPECT_TRUE(rigged_->RiggedNames(Split::kValidation).empty());
  // And by what they look like.
  std::set<double> statures[2];
  for (int i = 0; i < 60; ++i) {
    statures[0].insert(rigged_->Make(1, i, {.split = Split::kTrain, .rigged_share = 1}).stature);
    statures[1].insert(rigged_->Make(1, i, {.split = Split::kTest, .rigged_share = 1}).stature);
  }
  EXPECT_EQ(statures[0].size(), 5u);
  EXPECT_EQ(statures[1].size(), 3u);
  for (const double stature : statures[0]) EXPECT_FALSE(statures[1].contains(stature));
}

TEST_F(RiggedGeneratorTest, AShareOfZeroChangesNothing) {
  const CharacterOptions options{
      .vertices = -1, .anisotropic_scale = true, .shuffle_vertices = true, .noise = 0.01};
  for (int i = 0; i < 10; ++i) {
    const Character a = plain_->Make(2, i, options), b = rigged_->Make(2, i, options);
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.weights, b.weights);
    EXPECT_EQ(a.rotations, b.rotations);
  }
}

TEST_F(RiggedGeneratorTest, TheShareIsKept) {
  int count = 0;
  for (int i = 0; i < 400; ++i) {
    const Character c = rigged_->Make(3, i, {.vertices = 1500, .rigged_share = 0.25});
    const bool is_rigged = c.mesh.vertex_count() == kRigVertices;
    count += is_rigged ? 1 : 0;
    if (!is_rigged) {  // the others are those that they would be without
      EXPECT_EQ(c.mesh.positions, plain_->Make(3, i, {.vertices = 1500}).mesh.positions);
    }
  }
  EXPECT_NEAR(count, 100, 30);
}

TEST_F(RiggedGeneratorTest, CharactersAreWellFormed) {
  for (int i = 0; i < 20; ++i) {
    const Character c = rigged_->Make(
        4, i, {.anisotropic_scale = true, .shuffle_vertices = true, .noise = 0.005, .rigged_share = 1});
    ASSERT_EQ(c.mesh.vertex_count(), kRigVertices);
    EXPECT_EQ(c.canonical.rows(), kRigVertices);
    EXPECT_LT((c.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5f);
    EXPECT_TRUE(c.mesh.positions.allFinite() && c.canonical.allFinite());
    EXPECT_LT(c.canonical.cwiseAbs().maxCoeff(), 0.8f);
  }
}

TEST_F(RiggedGeneratorTest, TruthIsExactOnRigidParts) {
  for (int i = 0; i < 10; ++i) {
    const TransferPair pair = rigged_->MakePair(5, i, {.split = Split::kTest, .rigged_share = 1});
    ASSERT_EQ(pair.truth.rows(), kRigVertices);
    EXPECT_LT((pair.truth.topRows(8).colwise().mean() - pair.source.joints.row(kPelvis)).norm(), 0.2f);
    for (Eigen::Index j = 0; j < kHumanJoints; ++j) {  // each box goes by its joint's rotation
      const Rotation turn = pair.reference.rotations[j] * pair.source.rotations[j].transpose();
      const Eigen::RowVector3f edge =
          pair.source.mesh.positions.row(8 * j + 7) - pair.source.mesh.positions.row(8 * j);
      const Eigen::RowVector3f moved = pair.truth.row(8 * j + 7) - pair.truth.row(8 * j);
      EXPECT_LT((moved - edge * turn.transpose()).norm(), 1e-4f);
    }
  }
}

TEST_F(RiggedGeneratorTest, PosesOfOneIdentityKeepItsBones) {
  const auto poses = rigged_->MakePoses(6, 0, 4, {.rigged_share = 1});
  for (const Character& pose : poses) {
    EXPECT_EQ(pose.stature, poses[0].stature);
    EXPECT_EQ(pose.mesh.faces, poses[0].mesh.faces);
    for (int j = 1; j < kHumanJoints; ++j) {
      const auto length = [j](const Character& c) {
        return (c.joints.row(j) - c.joints.row(HumanSkeleton().parents()[j])).norm();
      };
      EXPECT_NEAR(length(pose), length(poses[0]), 1e-4);
    }
  }
}

TEST_F(RiggedGeneratorTest, SharesThatCannotBeAreRefused) {
  const auto code = [](const Generator& generator, Split split, double share) {
    return generator->Check({.split = split, .rigged_share = share}).code();
  };
  for (const Split split : {Split::kTrain, Split::kValidation, Split::kTest}) {
    EXPECT_EQ(code(plain_, split, 0), absl::StatusCode::kOk);
    EXPECT_EQ(code(plain_, split, 0.5), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(code(rigged_, split, 0.5),
              split == Split::kValidation ? absl::StatusCode::kInvalidArgument : absl::StatusCode::kOk);
    EXPECT_EQ(code(rigged_, split, -0.1), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(code(rigged_, split, 1.1), absl::StatusCode::kInvalidArgument);
  }
}

TEST_F(RiggedGeneratorTest, HolesTakeFacesOnlyAndSamplingBearsThem) {
  const CharacterOptions whole{.vertices = 1500};
  CharacterOptions holed = whole;
  holed.holes = 3;
  for (int i = 0; i < 10; ++i) {
    const Character a = plain_->Make(7, i, whole), b = plain_->Make(7, i, holed);
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.weights, b.weights);
    EXPECT_LT(b.mesh.face_count(), a.mesh.face_count());
    EXPECT_GE(SurfaceArea(b.mesh.positions, b.mesh.faces), 0.7 * SurfaceArea(a.mesh.positions, a.mesh.faces));
    const SurfaceSamples samples = ResampleSurface(b.mesh, {256});
    EXPECT_EQ(samples.points.rows(), 256);
    EXPECT_TRUE(samples.points.allFinite());
  }
}

}  // namespace
}  // namespace stance
