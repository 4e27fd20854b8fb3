#include "core/transfer/placement.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/transfer/bone_rotation_solver.h"
#include "core/transfer/learned_rotation_solver.h"
#include "tests/support/meshes.h"
#include "tests/support/puppet.h"

namespace stance {
namespace {

constexpr float kPi = static_cast<float>(EIGEN_PI);

Rotation About(const Eigen::Vector3f& axis, float angle) {
  return Eigen::AngleAxisf(angle, axis).toRotationMatrix();
}
Rotation Yaw(float angle) { return About(Eigen::Vector3f::UnitY(), angle); }
Rotation Pitch(float angle) { return About(Eigen::Vector3f::UnitX(), angle); }
Rotation Roll(float angle) { return About(Eigen::Vector3f::UnitZ(), angle); }

PelvisAxes AxesWhere(const Rotation& pelvis, PelvisAxes::Lead lead) {
  return {pelvis.col(2), pelvis.col(0), lead};
}
constexpr PelvisAxes::Lead kLeads[] = {PelvisAxes::Lead::kForward, PelvisAxes::Lead::kLeft};

// Random poses within the reach of a standing figure, as a whole turned by `whole`.
testing::Puppet Posed(uint64_t seed, const Rotation& whole, bool learned) {
  std::vector<Rotation> global = testing::RandomPose(seed, 0.6);
  for (Rotation& rotation : global) rotation = whole * rotation;
  const testing::Puppet rest = testing::MakePuppet();
  testing::Puppet puppet = testing::Pose(rest, global);
  if (learned) {
    puppet.rig.rotations = global;
    puppet.rig.bones = BoneVectors(HumanSkeleton(), rest.rig.joints);
  }
  return puppet;
}

std::vector<Rotation> Solve(const testing::Puppet& source, const testing::Puppet& reference, bool learned) {
  if (learned) {
    return LearnedRotationSolver().Solve(HumanSkeleton(), source.mesh, source.rig, reference.mesh,
                                         reference.rig);
  }
  return BoneRotationSolver(Twist::kInherited)
      .Solve(HumanSkeleton(), source.mesh, source.rig, reference.mesh, reference.rig);
}

TEST(Heading, OfTheRestPoseIsPlusZ) {
  testing::Puppet puppet = testing::MakePuppet();
  EXPECT_LT((Heading(AxesOf(puppet.rig)) - Eigen::Vector3f::UnitZ()).norm(), 1e-5f);
  puppet.rig.rotations.assign(kHumanJoints, Rotation::Identity());
  EXPECT_LT((Heading(AxesOf(puppet.rig)) - Eigen::Vector3f::UnitZ()).norm(), 1e-5f);
}

TEST(Heading, TurnsWithTheBody) {
  for (const PelvisAxes::Lead lead : kLeads) {
    for (const float angle : {0.3f, 1.9f, -2.8f}) {
      for (const Rotation& pose : {Pitch(0.5f), Roll(-0.7f), Rotation(Pitch(1.45f) * Roll(0.2f))}) {
        const Eigen::Vector3f expected = Yaw(angle) * Heading(AxesWhere(pose, lead));
        EXPECT_LT((Heading(AxesWhere(Yaw(angle) * pose, lead)) - expected).norm(), 1e-4f);
      }
    }
  }
}

// While the leading axis is within 60 degrees of level, it alone decides.
TEST(Heading, OfAnUprightBodyIsTheLeadingAxes) {
  const Rotation pose = Yaw(0.4f) * Pitch(0.6f) * Roll(0.5f);
  Eigen::Vector3f forward = pose.col(2);
  forward.y() = 0;
  EXPECT_LT((Heading(AxesWhere(pose, kLeads[0])) - forward.normalized()).norm(), 1e-5f);
  const Eigen::Vector3f by_left = pose.col(0).cross(Eigen::Vector3f::UnitY()).normalized();
  EXPECT_LT((Heading(AxesWhere(pose, kLeads[1])) - by_left).norm(), 1e-5f);
}

// On its back, on its face and on its sides a body faces where it would after getting up.
TEST(Heading, OfALyingBodyIsWhereItWouldFaceAfterRising) {
  for (const PelvisAxes::Lead lead : kLeads) {
    for (const Rotation& lying : {Pitch(kPi / 2), Pitch(-kPi / 2), Roll(kPi / 2), Roll(-kPi / 2)}) {
      EXPECT_LT((Heading(AxesWhere(lying, lead)) - Eigen::Vector3f::UnitZ()).norm(), 1e-4f);
      EXPECT_LT((Heading(AxesWhere(Yaw(1.1f) * lying, lead)) - Yaw(1.1f).col(2)).norm(), 1e-4f);
    }
  }
}

TEST(Heading, ChangesContinuouslyWhileABodyLiesDown) {
  for (const PelvisAxes::Lead lead : kLeads) {
    for (const Rotation& skew :
         {Rotation(Rotation::Identity()), Rotation(Roll(0.3f)), Rotation(Pitch(0.3f))}) {
      Eigen::Vector3f before = Heading(AxesWhere(skew, lead));
      for (float angle = 0; angle <= kPi / 2; angle += 0.01f) {
        const Rotation fall = lead == PelvisAxes::Lead::kForward ? Pitch(-angle) : Roll(angle);
        const Eigen::Vector3f now = Heading(AxesWhere(fall * skew, lead));
        EXPECT_LT((now - before).norm(), 0.1f) << angle;
        before = now;
      }
    }
  }
}

TEST(FacingTurn, MakesTheTargetFaceAsTheSource) {
  for (const bool learned : {false, true}) {
    for (uint64_t seed = 1; seed < 8; ++seed) {
      const testing::Puppet source = Posed(seed, Yaw(0.7f * static_cast<float>(seed)), learned);
      const testing::Puppet reference = Posed(seed + 50, Yaw(-1.3f * static_cast<float>(seed)), learned);
      const PelvisAxes axes = AxesOf(source.rig);
      const Rotation pelvis = Solve(source, reference, learned)[kPelvis];
      const Rotation turn = FacingTurn(axes, pelvis);
      EXPECT_LT((turn.col(1) - Eigen::Vector3f::UnitY()).norm(), 1e-5f);
      const Rotation turned = turn * pelvis;
      const Eigen::Vector3f target = Heading({turned * axes.forward, turned * axes.left, axes.lead});
      EXPECT_LT((target.normalized() - Heading(axes).normalized()).norm(), 1e-3f);
    }
  }
}

// However the reference stands about the up axis, the pose is the same.
TEST(FacingTurn, ForgetsTheReferencesYaw) {
  for (const bool learned : {false, true}) {
    const testing::Puppet source = Posed(3, Yaw(0.5f), learned);
    const auto placed = [&](float yaw) {
      std::vector<Rotation> rotations = Solve(source, Posed(4, Yaw(yaw), learned), learned);
      const Rotation turn = FacingTurn(AxesOf(source.rig), rotations[kPelvis]);
      for (Rotation& rotation : rotations) rotation = turn * rotation;
      return rotations;
    };
    const std::vector<Rotation> expected = placed(0);
    for (const float yaw : {0.4f, 1.7f, 3.1f, -2.2f}) {
      const std::vector<Rotation> rotations = placed(yaw);
      for (int j = 0; j < kHumanJoints; ++j) EXPECT_LT((rotations[j] - expected[j]).norm(), 5e-3f) << yaw;
    }
  }
}

TEST(FacingTurn, OwnPoseNeedsNone) {
  const testing::Puppet puppet = Posed(6, Yaw(2.0f), true);
  EXPECT_LT((FacingTurn(AxesOf(puppet.rig), Rotation::Identity()) - Rotation::Identity()).norm(), 1e-5f);
}

TEST(FacingTurn, IsNoneWhereNothingSaysWhereABodyFaces) {
  const Rotation identity = Rotation::Identity();
  EXPECT_EQ(FacingTurn(PelvisAxes{}, Yaw(1.0f)), identity);
  Rig coincident;
  coincident.joints = Points::Zero(kHumanJoints, 3);
  EXPECT_EQ(FacingTurn(AxesOf(coincident), Yaw(1.0f)), identity);
}

TEST(LowestHeight, IsAlongTheAxisAndOfWhatHasFaces) {
  TriangleMesh box = testing::Box(1, 2, 3);
  EXPECT_EQ(LowestHeight(box.positions, box.faces, Eigen::Vector3f::UnitY()), 0);
  EXPECT_EQ(LowestHeight(box.positions, box.faces, -Eigen::Vector3f::UnitZ()), -3);
  box.positions.conservativeResize(9, 3);
  box.positions.row(8) << 0, -5, 0;  // a stray vertex
  EXPECT_EQ(LowestHeight(box.positions, box.faces, Eigen::Vector3f::UnitY()), 0);
}

}  // namespace
}  // namespace stance
