#include "core/transfer/anatomical_limits.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/skeleton/mirror.h"
#include "tests/support/puppet.h"

namespace stance {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;
constexpr int kHinges[] = {kLeftKnee, kRightKnee, kLeftElbow, kRightElbow};

bool IsElbow(int hinge) { return hinge >= kLeftElbow; }

Rotation Turn(float degrees, const Eigen::Vector3f& axis) {
  return Eigen::AngleAxisf(degrees * kDegree, axis.normalized()).toRotationMatrix();
}

// The hinge's rotation relative to its parent: bent by `degrees` (backwards if negative) after a twist about
// the limb and a swing across the hinge.
Rotation Bent(int hinge, float degrees, float twist = 0, float across = 0) {
  const Eigen::Vector3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  if (!IsElbow(hinge)) return Turn(degrees, x) * Turn(across, z) * Turn(twist, y);
  return Turn(hinge == kLeftElbow ? -degrees : degrees, y) * Turn(across, z) * Turn(twist, x);
}

// How far the limb at the hinge is bent, from where its end goes, in degrees.
float BendOf(int hinge, const Rotation& local) {
  if (!IsElbow(hinge)) {
    const Eigen::Vector3f shin = local * Eigen::Vector3f(0, -1, 0);
    return std::atan2(-shin.z(), -shin.y()) / kDegree;
  }
  const float outward = hinge == kLeftElbow ? 1.0f : -1.0f;
  const Eigen::Vector3f forearm = local * Eigen::Vector3f(outward, 0, 0);
  return std::atan2(forearm.z(), outward * forearm.x()) / kDegree;
}

// A random pose but for the hinge.
std::vector<Rotation> PoseWith(int hinge, const Rotation& local, uint64_t seed = 1) {
  std::vector<Rotation> global = testing::RandomPose(seed, 0.5);
  for (const int other : kHinges) global[other] = global[HumanSkeleton().parents()[other]];
  global[hinge] = global[HumanSkeleton().parents()[hinge]] * local;
  return global;
}

Rotation Limited(int hinge, const Rotation& local, uint64_t seed = 1) {
  const std::vector<Rotation> global = WithinAnatomicalLimits(PoseWith(hinge, local, seed));
  return global[HumanSkeleton().parents()[hinge]].transpose() * global[hinge];
}

TEST(WithinAnatomicalLimits, ChangesNothingWithinThem) {
  for (const int hinge : kHinges) {
    for (const float bend : {-7.9f, -3.0f, 0.0f, 30.0f, 90.0f, 145.0f, 179.0f}) {
      const std::vector<Rotation> global = PoseWith(hinge, Bent(hinge, bend, 50, -20));
      EXPECT_EQ(WithinAnatomicalLimits(global), global) << hinge << " " << bend;
    }
  }
}

TEST(WithinAnatomicalLimits, DrawsBackWhatTheNetworkBendsBackwards) {
  for (const int hinge : kHinges) {
    for (const float bend : {-15.0f, -40.0f, -90.0f, -150.0f}) {
      const float limited = BendOf(hinge, Limited(hinge, Bent(hinge, bend)));
      EXPECT_GT(limited, -14.01f) << hinge << " " << bend;
      EXPECT_LT(limited, -8) << hinge << " " << bend;
    }
  }
}

TEST(WithinAnatomicalLimits, AreMonotoneAndContinuous) {
  for (const int hinge : kHinges) {
    float before = BendOf(hinge, Limited(hinge, Bent(hinge, 20)));
    for (float bend = 19.5f; bend > -170; bend -= 0.5f) {
      const float limited = BendOf(hinge, Limited(hinge, Bent(hinge, bend)));
      EXPECT_LE(limited, before + 1e-3f) << hinge << " " << bend;
      EXPECT_GE(limited, before - 0.51f) << hinge << " " << bend;
      before = limited;
    }
  }
}

TEST(WithinAnatomicalLimits, LeaveTwistAndSwingAcrossTheHinge) {
  for (const int hinge : kHinges) {
    for (const float twist : {-60.0f, 0.0f, 45.0f}) {
      for (const float across : {-10.0f, 10.0f}) {
        const Rotation limited = Limited(hinge, Bent(hinge, -40, twist, across));
        const float bend = BendOf(hinge, limited);
        EXPECT_LT((limited - Bent(hinge, bend, twist, across)).norm(), 1e-4f);
        EXPECT_GT(bend, -14.01f);
      }
    }
  }
}

TEST(WithinAnatomicalLimits, FadeOutAcrossTheHinge) {
  for (const int hinge : kHinges) {
    Rotation before = Limited(hinge, Bent(hinge, -30));
    for (float across = 0.5f; across < 120; across += 0.5f) {
      const Rotation bent = Bent(hinge, -30, 0, across), limited = Limited(hinge, bent);
      EXPECT_LT(Eigen::AngleAxisf(before.transpose() * limited).angle() / kDegree, 2)
          << hinge << " " << across;
      if (across > 21) {
        EXPECT_LT((limited - bent).norm(), 1e-5f) << hinge << " " << across;
      }
      before = limited;
    }
  }
}

// As in some captured clips: well bent, only seen from a wrongly twisted upper arm.
TEST(WithinAnatomicalLimits, LeaveLimbsOfTwistedParents) {
  for (const int hinge : kHinges) {
    const Eigen::Vector3f along = IsElbow(hinge) ? Eigen::Vector3f::UnitX() : Eigen::Vector3f::UnitY();
    for (const float twist : {-135.0f, 135.0f}) {
      const std::vector<Rotation> global = PoseWith(hinge, Turn(twist, along) * Bent(hinge, 100));
      EXPECT_EQ(WithinAnatomicalLimits(global), global);
    }
  }
}

TEST(WithinAnatomicalLimits, GiveRotationsAndLeaveTheOtherJoints) {
  for (uint64_t seed = 1; seed < 30; ++seed) {
    const std::vector<Rotation> global = testing::RandomPose(seed, 3.0);
    const std::vector<Rotation> limited = WithinAnatomicalLimits(global);
    for (int j = 0; j < kHumanJoints; ++j) {
      EXPECT_LT((limited[j] * limited[j].transpose() - Rotation::Identity()).norm(), 1e-5f);
      EXPECT_NEAR(limited[j].determinant(), 1, 1e-5f);
      if (std::find(std::begin(kHinges), std::end(kHinges), j) == std::end(kHinges)) {
        EXPECT_EQ(limited[j], global[j]);
      }
    }
  }
}

TEST(WithinAnatomicalLimits, TreatBothSidesAlike) {
  for (uint64_t seed = 1; seed < 30; ++seed) {
    const std::vector<Rotation> global = testing::RandomPose(seed, 2.0);
    const std::vector<Rotation> one = WithinAnatomicalLimits(MirroredRotations(global));
    const std::vector<Rotation> two = MirroredRotations(WithinAnatomicalLimits(global));
    for (int j = 0; j < kHumanJoints; ++j) EXPECT_LT((one[j] - two[j]).norm(), 1e-4f);
  }
}

TEST(WithinAnatomicalLimits, TurnWithTheBody) {
  const Rotation turn = Turn(130, {1, -2, 0.5f});
  std::vector<Rotation> global = PoseWith(kRightElbow, Bent(kRightElbow, -50));
  std::vector<Rotation> expected = WithinAnatomicalLimits(global);
  for (Rotation& rotation : global) rotation = turn * rotation;
  const std::vector<Rotation> limited = WithinAnatomicalLimits(global);
  for (int j = 0; j < kHumanJoints; ++j) EXPECT_LT((limited[j] - turn * expected[j]).norm(), 1e-4f);
}

}  // namespace
}  // namespace stance
