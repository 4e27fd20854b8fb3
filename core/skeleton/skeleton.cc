#include "core/skeleton/skeleton.h"

#include <utility>

#include "core/base/check.h"

namespace stance {

Skeleton::Skeleton(std::vector<std::string> names, std::vector<int> parents)
    : names_(std::move(names)), parents_(std::move(parents)), children_(parents_.size()) {
  STANCE_CHECK(!parents_.empty() && names_.size() == parents_.size());
  STANCE_CHECK(parents_[0] == -1);
  for (int joint = 1; joint < joint_count(); ++joint) {
    STANCE_CHECK(parents_[joint] >= 0 && parents_[joint] < joint);
    children_[parents_[joint]].push_back(joint);
  }
}

const Skeleton& HumanSkeleton() {
  static const Skeleton* const kSkeleton = new Skeleton(
      {"pelvis",     "left_hip",    "right_hip",    "spine1",      "left_knee",     "right_knee",
       "spine2",     "left_ankle",  "right_ankle",  "spine3",      "left_foot",     "right_foot",
       "neck",       "left_collar", "right_collar", "head",        "left_shoulder", "right_shoulder",
       "left_elbow", "right_elbow", "left_wrist",   "right_wrist", "left_hand",     "right_hand"},
      {-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21});
  return *kSkeleton;
}

int MirrorJoint(int human_joint) {
  const std::string& name = HumanSkeleton().names()[human_joint];
  std::string other = name;
  if (name.starts_with("left_")) other = "right_" + name.substr(5);
  if (name.starts_with("right_")) other = "left_" + name.substr(6);
  for (int joint = 0; joint < kHumanJoints; ++joint) {
    if (HumanSkeleton().names()[joint] == other) return joint;
  }
  return human_joint;
}

}  // namespace stance
