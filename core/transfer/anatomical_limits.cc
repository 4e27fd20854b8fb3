#include "core/transfer/anatomical_limits.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/check.h"

namespace stance {
namespace {

// How a rotation relative to the parent's bends a hinge.
struct Bend {
  Eigen::Vector3f axis;  // unit; turning about it straightens a hyperextended joint
  float past_straight;   // radians, in (-pi, pi]; positive if hyperextended
  float off;  // radians, in [0, pi]; how far from straight backwards the limb points, seen along it
};

// At rest the forearm lies along +-x and the shin along -y; their images' angles about the hinge do not
// depend on the twist about them.
Bend BendOf(int joint, const Rotation& local) {
  const float side = MirrorJoint(joint) > joint ? 1.0f : -1.0f;
  if (joint == kLeftElbow || joint == kRightElbow) {
    // Bending turns the forearm forward, to +z: by negative angles about y on the left.
    const Eigen::Vector3f forearm = side * local.col(0);
    return {-side * Eigen::Vector3f::UnitY(), std::atan2(-forearm.z(), side * forearm.x()),
            std::atan2(std::abs(forearm.y()), -forearm.z())};
  }
  // Bending turns the shin backward, to -z: by positive angles about x on both sides.
  const Eigen::Vector3f shin = -local.col(1);
  return {Eigen::Vector3f::UnitX(), std::atan2(shin.z(), -shin.y()),
          std::atan2(std::abs(shin.x()), shin.z())};
}

// How much of the pull applies. A limb that points well off straight backwards is not hyperextended: its
// parent is twisted, as the upper arms of some captured clips are, by 135 degrees and bent 40 to 50 off.
float Share(float off) {
  constexpr float kAll = 20 * std::numbers::pi_v<float> / 180, kNone = 37 * std::numbers::pi_v<float> / 180;
  const float t = std::clamp((kNone - off) / (kNone - kAll), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

}  // namespace

std::vector<Rotation> WithinAnatomicalLimits(std::vector<Rotation> global, const HingeLimit& limit) {
  STANCE_CHECK(global.size() == kHumanJoints && limit.margin > 0);
  for (const int joint : {kLeftKnee, kRightKnee, kLeftElbow, kRightElbow}) {
    const Rotation& parent = global[HumanSkeleton().parents()[joint]];
    const Rotation local = parent.transpose() * global[joint];
    const Bend bend = BendOf(joint, local);
    const float excess = std::max(0.0f, bend.past_straight - limit.free);
    const float back = (excess - limit.margin * std::tanh(excess / limit.margin)) * Share(bend.off);
    if (!(back > 0)) continue;
    global[joint] = parent * Eigen::AngleAxisf(back, bend.axis).toRotationMatrix() * local;
  }
  return global;
}

}  // namespace stance
