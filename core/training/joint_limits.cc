#include "core/training/joint_limits.h"

#include <Eigen/Geometry>

namespace stance {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;

using Range = std::array<AngleRange, 3>;

constexpr Range kNone = {};
constexpr Range kHip = {{{-125, 30}, {-40, 40}, {-20, 60}}};
constexpr Range kKnee = {{{0, 140}, {-15, 15}, {-6, 6}}};
constexpr Range kAnkle = {{{-30, 45}, {-20, 20}, {-20, 20}}};
constexpr Range kFoot = {{{-40, 25}, {-5, 5}, {-5, 5}}};
constexpr Range kCollar = {{{-12, 12}, {-15, 12}, {-10, 25}}};
constexpr Range kShoulder = {{{-60, 60}, {-110, 40}, {-88, 70}}};
constexpr Range kElbow = {{{-60, 60}, {-145, 5}, {-8, 8}}};
constexpr Range kWrist = {{{-30, 30}, {-25, 25}, {-55, 55}}};
constexpr Range kHand = {{{-5, 5}, {-8, 8}, {-75, 20}}};

constexpr std::array<Range, kHumanJoints> kRanges = {
    kNone,  // the pelvis: see the pose sampler's global turn
    kHip,      kHip,      {{{-15, 30}, {-20, 20}, {-15, 15}}},  // spine 1
    kKnee,     kKnee,     {{{-15, 25}, {-20, 20}, {-15, 15}}},  // spine 2
    kAnkle,    kAnkle,    {{{-15, 20}, {-20, 20}, {-12, 12}}},  // spine 3
    kFoot,     kFoot,     {{{-25, 25}, {-30, 30}, {-18, 18}}},  // neck
    kCollar,   kCollar,   {{{-25, 25}, {-35, 35}, {-18, 18}}},  // head
    kShoulder, kShoulder, kElbow,
    kElbow,    kWrist,    kWrist,
    kHand,     kHand};

bool IsRight(int joint) { return MirrorJoint(joint) < joint; }

}  // namespace

const std::array<AngleRange, 3>& JointRange(int joint) { return kRanges[joint]; }

Rotation JointRotation(int joint, const EulerAngles& degrees) {
  const double sign = IsRight(joint) ? -kRadiansPerDegree : kRadiansPerDegree;
  const Eigen::AngleAxisd x(kRadiansPerDegree * degrees.x, Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd y(sign * degrees.y, Eigen::Vector3d::UnitY());
  const Eigen::AngleAxisd z(sign * degrees.z, Eigen::Vector3d::UnitZ());
  if (joint >= kLeftShoulder) return (y * z * x).toRotationMatrix().cast<float>();
  if (joint == kLeftHip || joint == kRightHip) return (z * x * y).toRotationMatrix().cast<float>();
  return (x * z * y).toRotationMatrix().cast<float>();
}

}  // namespace stance
