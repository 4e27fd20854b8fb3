#include "core/training/pose_sampler.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/training/contact_pose.h"
#include "core/training/joint_limits.h"

namespace stance {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;

bool IsArm(int joint) { return joint >= kLeftCollar && joint != kHead; }

// An angle around 0, `amplitude` 1 reaching the ends of the range now and then.
double NarrowAngle(Random& random, const AngleRange& range, double amplitude) {
  const double x = std::clamp(random.Normal(0, 0.45 * amplitude), -1.0, 1.0);
  return x > 0 ? x * range.high : -x * range.low;
}

EulerAngles NarrowAngles(Random& random, int joint, double amplitude) {
  const auto& range = JointRange(joint);
  EulerAngles angles;
  angles.x = NarrowAngle(random, range[0], amplitude);
  angles.y = NarrowAngle(random, range[1], amplitude);
  angles.z = NarrowAngle(random, range[2], amplitude);
  return angles;
}

EulerAngles WideAngles(Random& random, int joint) {
  const auto& range = JointRange(joint);
  EulerAngles angles;
  angles.x = random.Uniform(range[0].low, range[0].high);
  angles.y = random.Uniform(range[1].low, range[1].high);
  angles.z = random.Uniform(range[2].low, range[2].high);
  return angles;
}

std::vector<Rotation> NarrowPose(Random& random, double amplitude) {
  std::vector<Rotation> local(kHumanJoints, Rotation::Identity());
  for (int j = 1; j < kHumanJoints; ++j) local[j] = JointRotation(j, NarrowAngles(random, j, amplitude));
  return local;
}

// Each joint anywhere in its range, some joints near rest.
std::vector<Rotation> WidePose(Random& random) {
  std::vector<Rotation> local(kHumanJoints, Rotation::Identity());
  for (int j = 1; j < kHumanJoints; ++j) {
    local[j] = JointRotation(j, random.Chance(0.75) ? WideAngles(random, j) : NarrowAngles(random, j, 1.0));
  }
  return local;
}

void HangArms(Random& random, std::vector<Rotation>& local) {
  for (const int shoulder : {kLeftShoulder, kRightShoulder}) {
    EulerAngles angles = NarrowAngles(random, shoulder, 0.3);
    angles.z = random.Uniform(-85, -40);
    local[shoulder] = JointRotation(shoulder, angles);
    angles = NarrowAngles(random, shoulder + 2, 0.3);
    angles.y = random.Uniform(-60, 0);
    local[shoulder + 2] = JointRotation(shoulder + 2, angles);
  }
}

void LegsTogether(Random& random, std::vector<Rotation>& local) {
  for (const int hip : {kLeftHip, kRightHip}) {
    EulerAngles angles = NarrowAngles(random, hip, 0.08);
    angles.z = random.Uniform(-11, -5);  // the legs rest spread by some 10 degrees each
    local[hip] = JointRotation(hip, angles);
    local[hip + 3] = JointRotation(hip + 3, NarrowAngles(random, hip + 3, 0.06));
  }
}

// T, A, arms down; legs as at rest or together; a little of everything else.
std::vector<Rotation> RestLikePose(Random& random) {
  std::vector<Rotation> local = NarrowPose(random, random.Uniform(0.0, 0.12));
  const int64_t arms = random.Below(4);
  if (arms == 1) {
    HangArms(random, local);
  } else if (arms > 1) {  // the A pose of most artists' characters, straight arms
    const double lowered = arms == 2 ? random.Uniform(-55, -25) : random.Uniform(-85, -60);
    for (const int shoulder : {kLeftShoulder, kRightShoulder}) {
      EulerAngles angles = NarrowAngles(random, shoulder, 0.08);
      angles.z = lowered + random.Normal(0, 2);
      local[shoulder] = JointRotation(shoulder, angles);
    }
  }
  if (random.Chance(0.5)) LegsTogether(random, local);
  return local;
}

enum LegStance { kStanding, kTogether, kSitting, kCrouching, kKneeling, kStepping, kCrossed, kLegStances };

void PoseLegs(Random& random, LegStance stance, std::vector<Rotation>& local) {
  for (const int hip : {kLeftHip, kRightHip}) {
    const int knee = hip + 3;
    EulerAngles h = NarrowAngles(random, hip, 0.15), k = NarrowAngles(random, knee, 0.1);
    switch (stance) {
      case kSitting:
        h.x = random.Uniform(-110, -70);
        h.z = random.Uniform(-11, 25);
        k.x = random.Uniform(60, 115);
        break;
      case kCrouching:
        h.x = random.Uniform(-125, -80);
        h.z = random.Uniform(-11, 35);
        k.x = random.Uniform(95, 140);
        break;
      case kKneeling:
        h.x = random.Uniform(-25, 10);
        h.z = random.Uniform(-11, 15);
        k.x = random.Uniform(85, 135);
        break;
      case kStepping:
        h.x = random.Uniform(-90, 25);
        h.z = random.Uniform(-10, 10);
        k.x = h.x < 0 ? random.Uniform(0, -h.x) : random.Uniform(0, 60);
        break;
      case kCrossed:
        h.x = (hip == kLeftHip ? -1 : 1) * random.Uniform(2, 12);
        h.z = random.Uniform(-20, -12);
        break;
      default:
        break;
    }
    local[hip] = JointRotation(hip, h);
    local[knee] = JointRotation(knee, k);
  }
  if (stance == kTogether) LegsTogether(random, local);
}

std::vector<Rotation> ContactPose(Random& random, const Points& rest) {
  std::vector<Rotation> local = NarrowPose(random, 0.3);
  const auto stance = static_cast<LegStance>(random.Below(kLegStances));
  PoseLegs(random, stance, local);
  if (random.Chance(0.85)) {
    PlaceHands(random, rest, local);
  } else {
    for (int j = 0; j < kHumanJoints; ++j) {
      if (IsArm(j)) local[j] = JointRotation(j, WideAngles(random, j));
    }
  }
  return local;
}

std::vector<Rotation> ModeratePose(Random& random, const MotionLibrary& motions, Split split) {
  const double kind = random.Uniform();
  if (kind < 0.5) {
    if (std::optional<std::vector<Rotation>> captured = motions.Sample(random, split)) return *captured;
  }
  if (kind < 0.7) return NarrowPose(random, 0.5);
  std::vector<Rotation> local = NarrowPose(random, random.Uniform(0.15, 0.45));
  HangArms(random, local);
  if (kind > 0.9) LegsTogether(random, local);
  return local;
}

std::vector<Rotation> HardPose(Random& random, const Points& rest) {
  const double kind = random.Uniform();
  if (kind < 0.5) return WidePose(random);
  if (kind < 0.85) return ContactPose(random, rest);
  std::vector<Rotation> local = WidePose(random);
  LegsTogether(random, local);
  return local;
}

}  // namespace

std::vector<Rotation> SamplePose(Random& random, PoseMix mix, const MotionLibrary& motions, Split split,
                                 const Points& rest) {
  if (mix == PoseMix::kTraining) {
    const double kind = random.Uniform();
    if (kind < 0.15) return RestLikePose(random);
    mix = kind < 0.55 ? PoseMix::kModerate : PoseMix::kHard;
  }
  return mix == PoseMix::kHard ? HardPose(random, rest) : ModeratePose(random, motions, split);
}

Rotation SampleGlobalTurn(Random& random) {
  const double yaw = random.Uniform(-EIGEN_PI, EIGEN_PI);
  double tilt[2];
  const bool large = random.Chance(1.0 / 12);
  for (double& angle : tilt) {
    angle = large ? random.Uniform(-90, 90) : std::clamp(random.Normal(0, 15), -70.0, 70.0);
    angle *= kRadiansPerDegree;
  }
  return (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(tilt[0], Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(tilt[1], Eigen::Vector3d::UnitZ()))
      .toRotationMatrix()
      .cast<float>();
}

}  // namespace stance
