// Joint trees, and the canonical human one.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/base/types.h"

namespace stance {

// A rooted tree of joints in an order where every parent precedes its children, so that a loop over
// 0..J-1 is a traversal from the root (every loop in Stance relies on it).
class Skeleton {
 public:
  // REQUIRES: parents[0] == -1 and 0 <= parents[j] < j for every other joint; as many names as parents.
  Skeleton(std::vector<std::string> names, std::vector<int> parents);

  int joint_count() const { return static_cast<int>(parents_.size()); }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<int>& parents() const { return parents_; }
  const std::vector<int>& children(int joint) const { return children_[joint]; }
  bool is_leaf(int joint) const { return children_[joint].empty(); }

 private:
  std::vector<std::string> names_;
  std::vector<int> parents_;
  std::vector<std::vector<int>> children_;
};

inline constexpr int kHumanJoints = 24;

// SMPL's 24 joints in SMPL's order, which already puts parents first. In the rest (T) pose the character
// faces +z, y is up, its left arm points to +x.
enum HumanJoint : int {
  kPelvis = 0,
  kLeftHip,
  kRightHip,
  kSpine1,
  kLeftKnee,
  kRightKnee,
  kSpine2,
  kLeftAnkle,
  kRightAnkle,
  kSpine3,
  kLeftFoot,
  kRightFoot,
  kNeck,
  kLeftCollar,
  kRightCollar,
  kHead,
  kLeftShoulder,
  kRightShoulder,
  kLeftElbow,
  kRightElbow,
  kLeftWrist,
  kRightWrist,
  kLeftHand,
  kRightHand,
};

// The canonical human skeleton; names are SMPL's ("pelvis", "left_hip", ...).
const Skeleton& HumanSkeleton();

// The joint on the other side of the body (itself for those on the midline).
int MirrorJoint(int human_joint);

}  // namespace stance
