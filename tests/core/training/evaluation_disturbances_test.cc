#include "core/training/evaluation_disturbances.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "core/mesh/measure.h"
#include "core/mesh/mesh_check.h"
#include "core/training/evaluation_pairs.h"
#include "tests/core/training/evaluation_fixture.h"
#include "tests/core/training/stick_character.h"

namespace stance {
namespace {

std::vector<Rotation> RandomPose(uint64_t seed) {
  Random random(seed);
  std::vector<Rotation> local(kHumanJoints);
  for (Rotation& rotation : local) {
    const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
    rotation = Eigen::AngleAxisd(random.Normal(0, 0.5), axis.normalized()).toRotationMatrix().cast<float>();
  }
  return GlobalRotations(HumanSkeleton(), local);
}

// Rigid weights: the truth's own parts reach the truth exactly.
TransferPair RigidPair() {
  Character rest = testing::StickCharacter();
  rest.canonical = rest.mesh.positions;
  TransferPair pair{testing::Posed(rest, RandomPose(1)), testing::Posed(rest, RandomPose(2)), {}};
  pair.truth = pair.reference.mesh.positions;  // the same identity, and the pelvis stays where it is
  return pair;
}

// Smooth weights on a body of 1,800 vertices.
TransferPair SmoothPair() {
  return testing::SmallGenerator().MakePair(
      3, 0, {.poses = PoseMix::kModerate, .split = Split::kTest, .global_rotation = true});
}

// Mean error of true weights, joints and rotations, millimetres.
double TrueParts(const TransferPair& pair) {
  const Candidate all_true = ComposeParts(pair, nullptr).back();
  EXPECT_EQ(all_true.method, "true weights, joints and rotations");
  return Judge("p", all_true, pair.truth, pair.source.mesh.faces, pair.source.stature).errors.mean_mm;
}

void ExpectConsistent(const TransferPair& pair) {
  const Eigen::Index vertices = pair.source.mesh.positions.rows();
  EXPECT_EQ(pair.truth.rows(), vertices);
  for (const Character* character : {&pair.source, &pair.reference}) {
    const TriangleMesh& mesh = character->mesh;
    EXPECT_EQ(character->weights.rows(), mesh.vertex_count());
    EXPECT_EQ(character->canonical.rows(), mesh.vertex_count());
    EXPECT_LT((character->weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-4f);
    EXPECT_TRUE(CheckMesh(mesh).ok()) << CheckMesh(mesh).status();
  }
}

void ExpectEqual(const TransferPair& a, const TransferPair& b) {
  EXPECT_EQ(a.truth, b.truth);
  EXPECT_EQ(a.source.mesh.positions, b.source.mesh.positions);
  EXPECT_EQ(a.source.mesh.faces, b.source.mesh.faces);
  EXPECT_EQ(a.reference.mesh.positions, b.reference.mesh.positions);
  EXPECT_EQ(a.reference.mesh.faces, b.reference.mesh.faces);
}

TEST(Disturbances, TrueWeightsJointsAndRotationsReachTheDisturbedTruth) {
  const TransferPair rigid = RigidPair();
  for (const int64_t count : {100, 192, 500, 5000}) EXPECT_NEAR(TrueParts(Remeshed(rigid, count)), 0, 1e-2);
  for (const double strength : {0.0, 0.01, 0.2}) {
    Random random(4);
    EXPECT_NEAR(TrueParts(WithNoise(rigid, strength, random)), 0, 1e-2);
    EXPECT_NEAR(TrueParts(WithHoles(rigid, strength, random)), 0, 1e-2);
    EXPECT_NEAR(TrueParts(Tilted(rigid, 10 * strength, random)), 0, 1e-2);
  }
}

// What skinning costs a posed source with smooth weights does not depend on noise and tilt.
TEST(Disturbances, NoiseAndTiltLeaveTheErrorOfTruePartsAsItIs) {
  const TransferPair pair = SmoothPair();
  const double own = TrueParts(pair);
  Random random(5);
  EXPECT_NEAR(TrueParts(WithNoise(pair, 0.01, random)), own, 1e-2);
  EXPECT_NEAR(TrueParts(Tilted(pair, 1.5, random)), own, 1e-2);
}

TEST(Disturbances, NoneIsThePairItself) {
  for (const TransferPair& pair : {RigidPair(), SmoothPair()}) {
    Random random(6);
    ExpectEqual(Remeshed(pair, pair.source.mesh.vertex_count()), pair);
    ExpectEqual(Remeshed(pair, pair.source.mesh.vertex_count() * 5 / 4, 1.3), pair);
    ExpectEqual(WithNoise(pair, 0, random), pair);
    ExpectEqual(WithHoles(pair, 0, random), pair);
    ExpectEqual(Tilted(pair, 0, random), pair);
  }
}

TEST(Disturbances, TheSameSeedDisturbsInTheSameWay) {
  const TransferPair pair = SmoothPair();
  const auto both = [&](const std::function<TransferPair(Random&)>& disturb) {
    Random first(7), second(7), other(8);
    const TransferPair one = disturb(first);
    ExpectEqual(one, disturb(second));
    EXPECT_NE(one.source.mesh.positions, disturb(other).source.mesh.positions);
  };
  both([&](Random& random) { return WithNoise(pair, 0.01, random); });
  both([&](Random& random) { return WithHoles(pair, 0.1, random); });
  both([&](Random& random) { return Tilted(pair, 1, random); });
}

TEST(Remeshed, HasTheCount) {
  const TransferPair pair = SmoothPair();
  for (const int64_t count : {1000, 1801, 5000, 20'000}) {
    const TransferPair remeshed = Remeshed(pair, count);
    ExpectConsistent(remeshed);
    for (const Character* character : {&remeshed.source, &remeshed.reference}) {
      EXPECT_NEAR(static_cast<double>(character->mesh.vertex_count()), count, 0.05 * count);
    }
  }
}

// Finer: the same surface, under the truth as well. Coarser: vertices of the pair, under the truth as well.
TEST(Remeshed, TheTruthIsRemeshedAsTheSourceIs) {
  const TransferPair pair = SmoothPair();
  const TransferPair fine = Remeshed(pair, 7000), coarse = Remeshed(pair, 1000);
  EXPECT_EQ(fine.truth.topRows(pair.truth.rows()), pair.truth);
  const double area = SurfaceArea(pair.truth, pair.source.mesh.faces);
  EXPECT_NEAR(SurfaceArea(fine.truth, fine.source.mesh.faces), area, 1e-4 * area);
  Eigen::Index at = 0;
  for (Eigen::Index v = 0; v < coarse.truth.rows(); ++v, ++at) {
    while (at < pair.truth.rows() &&
           coarse.source.mesh.positions.row(v) != pair.source.mesh.positions.row(at)) {
      ++at;
    }
    ASSERT_LT(at, pair.truth.rows()) << v;
    EXPECT_EQ(coarse.truth.row(v), pair.truth.row(at));
  }
}

TEST(WithNoise, MovesVerticesByItsDeviationAlongTheirNormals) {
  const TransferPair pair = SmoothPair();
  Random random(9);
  const TransferPair noisy = WithNoise(pair, 0.01, random);
  ExpectConsistent(noisy);
  for (const auto& [before, after] :
       {std::pair{&pair.source, &noisy.source}, std::pair{&pair.reference, &noisy.reference}}) {
    const Points normals = VertexNormals(before->mesh.positions, before->mesh.faces);
    const Points moved = after->mesh.positions - before->mesh.positions;
    const Eigen::VectorXf along = moved.cwiseProduct(normals).rowwise().sum();
    EXPECT_NEAR(std::sqrt(along.squaredNorm() / static_cast<float>(along.size())), 0.01 * before->stature,
                0.05 * 0.01 * before->stature);
    EXPECT_NEAR(along.mean(), 0, 0.1 * 0.01 * before->stature);
    EXPECT_NEAR(moved.norm(), along.norm(), 1e-4 * along.norm());
  }
  EXPECT_NE(noisy.truth, pair.truth);
}

TEST(WithHoles, TheShareOfTheAreaIsGone) {
  const TransferPair pair = SmoothPair();
  const auto share = [](const Character& before, const Character& after) {
    return 1 - SurfaceArea(after.mesh.positions, after.mesh.faces) /
                   SurfaceArea(before.mesh.positions, before.mesh.faces);
  };
  for (const double asked : {0.05, 0.1, 0.2, 0.3}) {
    Random random(10);
    const TransferPair cut = WithHoles(pair, asked, random);
    ExpectConsistent(cut);
    EXPECT_NEAR(share(pair.source, cut.source), asked, 0.01);
    EXPECT_NEAR(share(pair.reference, cut.reference), asked, 0.01);
    EXPECT_LT(cut.truth.rows(), pair.truth.rows());
    EXPECT_EQ(CheckMesh(cut.source.mesh)->unreferenced_vertices, 0);
  }
}

TEST(Tilted, TurnsBothAboutTheSameHorizontalAxisThroughTheirPelves) {
  const TransferPair pair = SmoothPair();
  for (const double degrees : {30, 60, 90, 180}) {
    Random random(11);
    const TransferPair tilted = Tilted(pair, degrees * std::numbers::pi / 180, random);
    ExpectConsistent(tilted);
    const Rotation turn = tilted.source.rotations[0] * pair.source.rotations[0].transpose();
    EXPECT_TRUE(
        turn.isApprox(tilted.reference.rotations[7] * pair.reference.rotations[7].transpose(), 1e-4f));
    const Eigen::AngleAxisf angle_axis(turn);
    EXPECT_NEAR(std::abs(angle_axis.angle()), degrees * std::numbers::pi / 180, 1e-3);
    EXPECT_NEAR(angle_axis.axis().y(), 0, 1e-3);
    EXPECT_EQ(tilted.source.joints.row(0), pair.source.joints.row(0));
    EXPECT_EQ(tilted.reference.joints.row(0), pair.reference.joints.row(0));
    // The truth keeps its distance from the pelvis that it shares with the source.
    const Eigen::RowVector3f pelvis = pair.source.joints.row(0);
    const Eigen::VectorXf before = (pair.truth.rowwise() - pelvis).rowwise().norm();
    EXPECT_TRUE(before.isApprox((tilted.truth.rowwise() - pelvis).rowwise().norm(), 1e-4f));
  }
}

}  // namespace
}  // namespace stance
