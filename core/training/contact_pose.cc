#include "core/training/contact_pose.h"

#include <Eigen/Geometry>
#include <cmath>

#include "core/training/joint_limits.h"
#include "core/training/skinning.h"

namespace stance {
namespace {

constexpr double kMostFlexion = 150;  // degrees
constexpr int kSwivels = 36;

enum Place {
  kThigh,
  kOnHip,
  kBelly,
  kChest,
  kOtherShoulder,
  kOnHead,
  kSide,
  kBehind,
  kOtherForearm,
  kPlaces
};

struct PosedSkeleton {
  std::vector<Rotation> global;
  Points joints;
};

PosedSkeleton Pose(const Points& rest, const std::vector<Rotation>& local) {
  PosedSkeleton posed;
  posed.global = GlobalRotations(HumanSkeleton(), local);
  posed.joints = TransformJoints(rest, PoseTransforms(HumanSkeleton(), rest, posed.global));
  return posed;
}

// A joint's place plus an offset (metres on a body of 1.7 m; x outwards on this side) in that joint's frame.
Eigen::Vector3f Near(const PosedSkeleton& posed, int joint, double size, bool left, Eigen::Vector3d offset) {
  if (!left) offset.x() = -offset.x();
  return posed.joints.row(joint).transpose() + posed.global[joint] * (size * offset).cast<float>();
}

// Where the wrist goes so that the hand lies on the place.
Eigen::Vector3f WristTarget(Random& random, Place place, bool left, const PosedSkeleton& posed, double size) {
  const auto jitter = [&](double x, double y, double z) {
    return Eigen::Vector3d(x + random.Normal(0, 0.02), y + random.Normal(0, 0.025),
                           z + random.Normal(0, 0.02));
  };
  const int hip = left ? kLeftHip : kRightHip;
  switch (place) {
    case kThigh:
      return Near(posed, hip, size, left, jitter(0.02, -random.Uniform(0.12, 0.35), 0.11));
    case kOnHip:
      return Near(posed, kPelvis, size, left, jitter(0.20, 0.06, 0.02));
    case kBelly:
      return Near(posed, kSpine1, size, left, jitter(0.08, 0.0, 0.15));
    case kChest:
      return Near(posed, kSpine3, size, left, jitter(0.06, 0.02, 0.17));
    case kOtherShoulder:
      return Near(posed, kSpine3, size, left, jitter(-0.08, 0.06, 0.19));
    case kOnHead:
      return Near(posed, kHead, size, left, jitter(0.13, random.Uniform(0.0, 0.2), 0.02));
    case kBehind:
      return Near(posed, kSpine1, size, left, jitter(0.08, -0.05, -0.16));
    case kOtherForearm:  // arms crossed before the chest, one above the other
      return Near(posed, kSpine2, size, left, jitter(-0.10, left ? 0.03 : -0.02, left ? 0.22 : 0.18));
    default:
      return Near(posed, hip, size, left,
                  jitter(random.Uniform(0.10, 0.14), -random.Uniform(0.0, 0.1), 0.03));
  }
}

}  // namespace

void ReachWith(bool left, const Eigen::Vector3f& target, const Eigen::Vector3f& elbow_hint,
               const Points& rest, std::vector<Rotation>& local) {
  const int collar = left ? kLeftCollar : kRightCollar, shoulder = left ? kLeftShoulder : kRightShoulder;
  const int elbow = left ? kLeftElbow : kRightElbow, wrist = left ? kLeftWrist : kRightWrist;
  const PosedSkeleton posed = Pose(rest, local);
  const Rotation& frame = posed.global[collar];
  const Eigen::Vector3f upper = (rest.row(elbow) - rest.row(shoulder)).transpose();
  const Eigen::Vector3f lower = (rest.row(wrist) - rest.row(elbow)).transpose();
  const Eigen::Vector3f to_target =
      frame.transpose() * (target - posed.joints.row(shoulder).transpose());  // in the collar's frame

  // More flexion brings the wrist nearer: bisect for the distance.
  double low = 0, high = kMostFlexion;
  for (int step = 0; step < 24; ++step) {
    const double flexion = 0.5 * (low + high);
    const bool far = (upper + JointRotation(elbow, {0, -flexion, 0}) * lower).norm() > to_target.norm();
    (far ? low : high) = flexion;
  }
  local[elbow] = JointRotation(elbow, {0, -0.5 * (low + high), 0});
  const Rotation aim = SmallestRotation(upper + local[elbow] * lower, to_target);
  const Eigen::Vector3f hint = frame.transpose() * elbow_hint;
  float best = -1e9f;
  for (int k = 0; k < kSwivels; ++k) {
    const float angle = static_cast<float>(2 * EIGEN_PI) * static_cast<float>(k) / kSwivels;
    const Rotation turned = Eigen::AngleAxisf(angle, to_target.normalized()) * aim;
    const float score = (turned * upper).dot(hint);
    if (score > best) {
      best = score;
      local[shoulder] = turned;
    }
  }
}

void PlaceHands(Random& random, const Points& rest, std::vector<Rotation>& local) {
  const PosedSkeleton posed = Pose(rest, local);
  const double size = (rest.row(kHead).y() - rest.row(kLeftAnkle).y()) / 1.4;  // 1.4 m on a body of 1.7 m
  Place places[2];
  places[0] = static_cast<Place>(random.Below(kPlaces));
  places[1] = random.Chance(0.5) ? places[0] : static_cast<Place>(random.Below(kPlaces));
  for (int i = 0; i < 2; ++i) {
    const bool left = i == 0;
    const Eigen::Vector3f target = WristTarget(random, places[i], left, posed, size);
    const bool high = places[i] == kOnHead;
    // Elbows hang outwards and down, and stand out backwards or sideways when the hand is high.
    Eigen::Vector3f hint(left ? 0.7f : -0.7f, high ? 0.2f : -0.6f, high ? 0.0f : -0.35f);
    for (int c = 0; c < 3; ++c) hint[c] += static_cast<float>(random.Normal(0, 0.2));
    ReachWith(left, target, posed.global[kSpine3] * hint, rest, local);
  }
}

}  // namespace stance
