#include "core/training/character_generator.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/skeleton/skeleton.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

// A generator on the small data, or on the real ones where STANCE_MPFB_DIR and STANCE_BVH_DIR name them.
class CharacterGeneratorTest : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    std::unique_ptr<CharacterGenerator>& shared = GetParam() ? real_ : small_;
    if (!shared) {
      const testing::TemporaryFolder folder;
      std::filesystem::path mpfb = folder.path() / "mpfb", bvh = folder.path() / "bvh";
      if (GetParam()) {
        const char* mpfb_dir = std::getenv("STANCE_MPFB_DIR");
        const char* bvh_dir = std::getenv("STANCE_BVH_DIR");
        if (mpfb_dir == nullptr || bvh_dir == nullptr) {
          GTEST_SKIP() << "STANCE_MPFB_DIR and STANCE_BVH_DIR don't name the data";
        }
        mpfb = mpfb_dir;
        bvh = bvh_dir;
      } else {
        testing::WriteSmallBody(mpfb);
        testing::WriteSmallMotions(bvh, 20);
      }
      auto generator = CharacterGenerator::FromData(mpfb, bvh);
      ASSERT_TRUE(generator.ok()) << generator.status();
      shared = *std::move(generator);
    }
    generator_ = shared.get();
  }
  static void TearDownTestSuite() {
    small_.reset();
    real_.reset();
  }

  static std::unique_ptr<CharacterGenerator> small_, real_;
  const CharacterGenerator* generator_ = nullptr;
};

std::unique_ptr<CharacterGenerator> CharacterGeneratorTest::small_, CharacterGeneratorTest::real_;

INSTANTIATE_TEST_SUITE_P(Data, CharacterGeneratorTest, ::testing::Values(false, true),
                         [](const auto& test_case) { return test_case.param ? "Real" : "Small"; });

CharacterOptions Everything() {
  CharacterOptions options;
  options.vertices = -1;
  options.anisotropic_scale = true;
  options.shuffle_vertices = true;
  options.noise = 0.005;
  return options;
}

bool Equal(const Character& a, const Character& b) {
  return a.mesh.positions == b.mesh.positions && a.mesh.faces == b.mesh.faces && a.weights == b.weights &&
         a.joints == b.joints && a.rotations == b.rotations && a.canonical == b.canonical &&
         a.stature == b.stature;
}

// Also of limbs scaled by themselves: the solver of METHOD_STANCE stands on it.
TEST_P(CharacterGeneratorTest, RotationsCarryRestBonesOntoPosedOnes) {
  for (int i = 0; i < 10; ++i) {
    const Character character = generator_->Make(4, i, Everything());
    const Points rest = BoneVectors(HumanSkeleton(), character.rest_joints),
                 posed = BoneVectors(HumanSkeleton(), character.joints);
    for (int j = 1; j < kHumanJoints; ++j) {
      const Rotation& parent = character.rotations[HumanSkeleton().parents()[j]];
      EXPECT_LT((rest.row(j) * parent.transpose() - posed.row(j)).norm(), 1e-4f) << i << " joint " << j;
    }
  }
}

TEST_P(CharacterGeneratorTest, CharactersAreWellFormed) {
  for (int i = 0; i < 40; ++i) {
    const Character c = generator_->Make(1, i, Everything());
    const int64_t vertices = c.mesh.vertex_count();
    ASSERT_GT(vertices, 0);
    EXPECT_EQ(c.weights.rows(), vertices);
    EXPECT_EQ(c.weights.cols(), kHumanJoints);
    EXPECT_EQ(c.canonical.rows(), vertices);
    EXPECT_EQ(c.joints.rows(), kHumanJoints);
    EXPECT_GE(c.weights.minCoeff(), 0);
    EXPECT_LT((c.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-4f);
    EXPECT_TRUE(c.mesh.positions.allFinite() && c.joints.allFinite() && c.canonical.allFinite());
    EXPECT_GE(c.mesh.faces.minCoeff(), 0);
    EXPECT_LT(c.mesh.faces.maxCoeff(), vertices);
    EXPECT_GT(c.stature, 0.8);
    EXPECT_LT(c.stature, 2.8);
    ASSERT_EQ(c.rotations.size(), static_cast<size_t>(kHumanJoints));
    for (const Rotation& r : c.rotations) EXPECT_TRUE((r * r.transpose()).isIdentity(1e-3f));
  }
}

TEST_P(CharacterGeneratorTest, SameArgumentsSameCharacterOnAnyThread) {
  const CharacterOptions options = Everything();
  std::vector<Character> first;
  for (int i = 0; i < 6; ++i) first.push_back(generator_->Make(2, i, options));
  std::vector<Character> second(6);
  std::vector<std::thread> threads;
  for (int i = 5; i >= 0; --i) threads.emplace_back([&, i] { second[i] = generator_->Make(2, i, options); });
  for (std::thread& thread : threads) thread.join();
  for (int i = 0; i < 6; ++i) {
    EXPECT_TRUE(Equal(first[i], second[i])) << i;
    for (int k = 0; k < i; ++k) EXPECT_FALSE(Equal(first[i], first[k]));
  }
}

TEST_P(CharacterGeneratorTest, SplitsAndSeedsDiffer) {
  std::set<double> statures;
  CharacterOptions options;
  for (const Split split : {Split::kTrain, Split::kValidation, Split::kTest}) {
    options.split = split;
    for (uint64_t seed = 0; seed < 10; ++seed) {
      for (int i = 0; i < 5; ++i) statures.insert(generator_->Make(seed, i, options).stature);
    }
  }
  EXPECT_EQ(statures.size(), 150u);
}

TEST_P(CharacterGeneratorTest, BoneLengthsOfOneIdentityAreConstant) {
  CharacterOptions options;
  options.poses = PoseMix::kHard;
  const std::vector<Character> poses = generator_->MakePoses(3, 0, 12, options);
  ASSERT_EQ(poses.size(), 12u);
  for (const Character& pose : poses) {
    EXPECT_LT((pose.joints.row(kPelvis) - poses[0].joints.row(kPelvis)).norm(), 1e-6f);
    for (int j = 1; j < kHumanJoints; ++j) {
      const int parent = HumanSkeleton().parents()[j];
      EXPECT_NEAR((pose.joints.row(j) - pose.joints.row(parent)).norm(),
                  (poses[0].joints.row(j) - poses[0].joints.row(parent)).norm(), 1e-4);
    }
  }
  EXPECT_GT((poses[0].mesh.positions - poses[1].mesh.positions).norm(), 0.1f);
  EXPECT_TRUE(Equal(poses[0], generator_->Make(3, 0, options)));
}

TEST_P(CharacterGeneratorTest, BonesFollowTheGlobalRotations) {
  const Character neutral = generator_->Neutral(1500);
  for (const Rotation& r : neutral.rotations) EXPECT_TRUE(r.isIdentity());
  // Two poses of one identity: the bones in one are the other's by the rotations' difference.
  CharacterOptions options;
  const std::vector<Character> poses = generator_->MakePoses(4, 0, 2, options);
  for (int j = 1; j < kHumanJoints; ++j) {
    const int parent = HumanSkeleton().parents()[j];
    const auto resting = [&](int pose) -> Eigen::Vector3f {
      return poses[pose].rotations[parent].transpose() *
             (poses[pose].joints.row(j) - poses[pose].joints.row(parent)).transpose();
    };
    EXPECT_LT((resting(0) - resting(1)).norm(), 1e-4f);
  }
}

TEST_P(CharacterGeneratorTest, TheNeutralRestsInATPose) {
  const Character neutral = generator_->Neutral();
  EXPECT_NEAR(neutral.mesh.positions.col(1).minCoeff(), 0, 1e-3);
  EXPECT_NEAR(neutral.mesh.positions.col(1).maxCoeff(), neutral.stature, 1e-3);
  EXPECT_NEAR(neutral.joints(kLeftHand, 1), neutral.joints(kLeftShoulder, 1), 1e-3);
  EXPECT_GT(neutral.joints(kLeftHand, 0), neutral.joints(kLeftShoulder, 0) + 0.3f);
  EXPECT_GT(neutral.joints(kLeftFoot, 2), neutral.joints(kLeftAnkle, 2));  // toes to +z
  const Points restored = neutral.canonical * static_cast<float>(neutral.stature);
  EXPECT_LT(((restored.rowwise() - restored.row(0)) -
             (neutral.mesh.positions.rowwise() - neutral.mesh.positions.row(0)))
                .cwiseAbs()
                .maxCoeff(),
            1e-4f);
}

TEST_P(CharacterGeneratorTest, ShufflingPermutesTheVerticesOnly) {
  CharacterOptions options;
  options.vertices = 1500;
  const Character plain = generator_->Make(5, 0, options);
  options.shuffle_vertices = true;
  const Character shuffled = generator_->Make(5, 0, options);
  EXPECT_NE(plain.mesh.faces, shuffled.mesh.faces);
  ASSERT_EQ(plain.mesh.face_count(), shuffled.mesh.face_count());
  for (Eigen::Index f = 0; f < plain.mesh.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int v = plain.mesh.faces(f, c), u = shuffled.mesh.faces(f, c);
      EXPECT_EQ(plain.mesh.positions.row(v), shuffled.mesh.positions.row(u));
      EXPECT_EQ(plain.weights.row(v), shuffled.weights.row(u));
      EXPECT_EQ(plain.canonical.row(v), shuffled.canonical.row(u));
    }
  }
}

TEST_P(CharacterGeneratorTest, NoiseStaysWithinItsBound) {
  CharacterOptions options;
  options.vertices = 1500;
  const Character plain = generator_->Make(6, 0, options);
  options.noise = 0.01;
  const Character noisy = generator_->Make(6, 0, options);
  const Eigen::VectorXf moved = (plain.mesh.positions - noisy.mesh.positions).rowwise().norm();
  EXPECT_LE(moved.maxCoeff(), 0.0101f);
  EXPECT_GT(moved.mean(), 0.003f);
  EXPECT_EQ(plain.joints, noisy.joints);
}

TEST_P(CharacterGeneratorTest, OptionsChangeOnlyWhatTheyName) {
  CharacterOptions options;
  options.vertices = 1500;
  const Character turned = generator_->Make(7, 3, options);
  options.global_rotation = false;
  const Character facing = generator_->Make(7, 3, options);
  EXPECT_EQ(turned.stature, facing.stature);
  const Rotation difference = turned.rotations[kPelvis] * facing.rotations[kPelvis].transpose();
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_TRUE(turned.rotations[j].isApprox(difference * facing.rotations[j], 1e-3f));
  }
}

// The character's mesh with other global rotations, by undoing its own skinning vertex by vertex.
Points Reposed(const Character& character, const std::vector<Rotation>& rotations) {
  const Skeleton& skeleton = HumanSkeleton();
  Points rest = character.joints;
  for (int j = 1; j < kHumanJoints; ++j) {
    const int parent = skeleton.parents()[j];
    const Eigen::RowVector3f bone = character.joints.row(j) - character.joints.row(parent);
    rest.row(j) = rest.row(parent) + bone * character.rotations[parent];  // R^T as it acts on rows
  }
  const auto from = PoseTransforms(skeleton, rest, character.rotations);
  const auto to = PoseTransforms(skeleton, rest, rotations);
  Points result(character.mesh.positions.rows(), 3);
  for (Eigen::Index v = 0; v < result.rows(); ++v) {
    AffineTransform blend_from, blend_to;
    blend_from.linear = blend_to.linear = Eigen::Matrix3f::Zero();
    for (int j = 0; j < kHumanJoints; ++j) {
      const float weight = character.weights(v, j);
      blend_from.linear += weight * from[j].linear;
      blend_from.translation += weight * from[j].translation;
      blend_to.linear += weight * to[j].linear;
      blend_to.translation += weight * to[j].translation;
    }
    const Eigen::Vector3f posed = character.mesh.positions.row(v).transpose() - blend_from.translation;
    result.row(v) = blend_to.Apply(blend_from.linear.inverse() * posed).transpose();
  }
  return result;
}

TEST_P(CharacterGeneratorTest, TruthIsTheSourceInTheReferencesPose) {
  CharacterOptions options;
  options.poses = PoseMix::kModerate;  // far from the poses where blended transforms collapse
  options.vertices = 1500;
  options.shuffle_vertices = true;
  for (int i = 0; i < 10; ++i) {
    const TransferPair pair = generator_->MakePair(8, i, options);
    EXPECT_NE(pair.source.stature, pair.reference.stature);
    ASSERT_EQ(pair.truth.rows(), pair.source.mesh.vertex_count());
    // In its own pose the source is itself: the check of the check.
    EXPECT_LT(
        (Reposed(pair.source, pair.source.rotations) - pair.source.mesh.positions).cwiseAbs().maxCoeff(),
        1e-3f);
    EXPECT_LT((Reposed(pair.source, pair.reference.rotations) - pair.truth).cwiseAbs().maxCoeff(), 2e-3f);
    EXPECT_GT((pair.truth - pair.source.mesh.positions).cwiseAbs().maxCoeff(), 0.05f);
    EXPECT_TRUE(Equal(pair.source, generator_->Make(8, i, options)));
  }
}

// Anisotropic scale lies between rest and rotation, so it stays with the source: a part that hangs on one
// joint goes from source to truth by the rotations' difference alone.
TEST_P(CharacterGeneratorTest, TruthKeepsTheSourcesOwnStyle) {
  CharacterOptions options;
  options.anisotropic_scale = true;
  int checked = 0;
  for (int i = 0; i < 10; ++i) {
    const TransferPair pair = generator_->MakePair(9, i, options);
    for (int joint = 0; joint < kHumanJoints; ++joint) {
      std::vector<Eigen::Index> rigid;
      for (Eigen::Index v = 0; v < pair.truth.rows(); ++v) {
        if (pair.source.weights(v, joint) > 0.99999f) rigid.push_back(v);
      }
      if (rigid.size() < 2) continue;
      ++checked;
      const Rotation turn = pair.reference.rotations[joint] * pair.source.rotations[joint].transpose();
      const auto edge = [&rigid](const Points& points) -> Eigen::Vector3f {
        return (points.row(rigid.back()) - points.row(rigid.front())).transpose();
      };
      EXPECT_LT((edge(pair.truth) - turn * edge(pair.source.mesh.positions)).norm(), 5e-4f);
    }
  }
  EXPECT_GT(checked, 0);
}

TEST_P(CharacterGeneratorTest, NoiseAppliesToTheReferenceOnly) {
  CharacterOptions options;
  options.vertices = 1500;
  const TransferPair clean = generator_->MakePair(10, 0, options);
  options.noise = 0.01;
  const TransferPair noisy = generator_->MakePair(10, 0, options);
  EXPECT_EQ(clean.source.mesh.positions, noisy.source.mesh.positions);
  EXPECT_EQ(clean.truth, noisy.truth);
  EXPECT_NE(clean.reference.mesh.positions, noisy.reference.mesh.positions);
}

TEST_P(CharacterGeneratorTest, APackGivesTheSameCharacters) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "humans.pack";
  ASSERT_TRUE(generator_->WritePack(path).ok());
  EXPECT_LT(std::filesystem::file_size(path), 30u << 20);
  const auto packed = CharacterGenerator::FromPack(path);
  ASSERT_TRUE(packed.ok()) << packed.status();
  for (int i = 0; i < 10; ++i)
    EXPECT_TRUE(Equal(generator_->Make(11, i, Everything()), (*packed)->Make(11, i, Everything())));
}

TEST(CharacterGenerator, ReportsMissingAndDamagedFiles) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(CharacterGenerator::FromPack(folder.path() / "none.pack").status().code(),
            absl::StatusCode::kNotFound);
  const std::filesystem::path path = folder.path() / "bad.pack";
  std::ofstream(path) << "STANCEPK but not really";
  const auto damaged = CharacterGenerator::FromPack(path);
  EXPECT_EQ(damaged.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(std::string(damaged.status().message()).find("bad.pack"), std::string::npos);
  EXPECT_EQ(CharacterGenerator::FromData(folder.path() / "mpfb", folder.path()).status().code(),
            absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace stance
