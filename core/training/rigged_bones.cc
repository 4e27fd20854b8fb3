#include "core/training/rigged_bones.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "core/skeleton/bone_names.h"

namespace stance {
namespace {

using JointNames = std::vector<std::string>;  // (24)

// 3ds Max's biped without its "Bip01 ", which counts fingers from the thumb.
const JointNames kBiped = {"Pelvis",    "L Thigh",    "R Thigh",    "Spine",  "L Calf",     "R Calf",
                           "Spine1",    "L Foot",     "R Foot",     "Spine2", "L Toe0",     "R Toe0",
                           "Neck",      "L Clavicle", "R Clavicle", "Head",   "L UpperArm", "R UpperArm",
                           "L Forearm", "R Forearm",  "L Hand",     "R Hand", "L Finger2",  "R Finger2"};

const JointNames kRigify = {"DEF-hips",        "DEF-thigh.L",     "DEF-thigh.R",       "DEF-spine.001",
                            "DEF-shin.L",      "DEF-shin.R",      "DEF-spine.002",     "DEF-foot.L",
                            "DEF-foot.R",      "DEF-spine.003",   "DEF-toe.L",         "DEF-toe.R",
                            "DEF-neck",        "DEF-shoulder.L",  "DEF-shoulder.R",    "DEF-head",
                            "DEF-upper_arm.L", "DEF-upper_arm.R", "DEF-forearm.L",     "DEF-forearm.R",
                            "DEF-hand.L",      "DEF-hand.R",      "DEF-f_middle.01.L", "DEF-f_middle.01.R"};

std::vector<const JointNames*> KnownNamings() {
  std::vector<const JointNames*> namings = {&kBiped, &kRigify};
  for (const BoneNaming naming :
       {BoneNaming::kSmpl, BoneNaming::kMixamo, BoneNaming::kVrm, BoneNaming::kUnreal}) {
    namings.push_back(&HumanBoneNames(naming));
  }
  return namings;
}

// The name without a biped's prefix: "Bip", two digits and a space.
std::string_view WithoutPrefix(std::string_view name) {
  return name.starts_with("Bip") && name.size() > 6 && name[5] == ' ' ? name.substr(6) : name;
}

int RowOf(const std::vector<FileBone>& bones, std::string_view name) {
  const auto bone = std::find_if(bones.begin(), bones.end(),
                                 [&](const FileBone& b) { return WithoutPrefix(b.name) == name; });
  return bone == bones.end() ? -1 : static_cast<int>(bone - bones.begin());
}

bool IsThumb(std::string name) {
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name.find("thumb") != std::string::npos || name.find("finger0") != std::string::npos;
}

// The first finger but the thumb on a wrist's bone; -1: there is none.
int FingerOf(const std::vector<FileBone>& bones, int wrist) {
  const auto finger = std::find_if(bones.begin(), bones.end(), [wrist](const FileBone& b) {
    return wrist >= 0 && b.parent == wrist && !IsThumb(b.name);
  });
  return finger == bones.end() ? -1 : static_cast<int>(finger - bones.begin());
}

using JointRows = std::array<int, kHumanJoints>;

// (24) the bones of these names; where a hand has no middle finger, another one.
JointRows RowsOf(const std::vector<FileBone>& bones, const JointNames& naming) {
  JointRows rows;
  std::transform(naming.begin(), naming.end(), rows.begin(),
                 [&](const std::string& name) { return RowOf(bones, name); });
  if (rows[kLeftHand] < 0) rows[kLeftHand] = FingerOf(bones, rows[kLeftWrist]);
  if (rows[kRightHand] < 0) rows[kRightHand] = FingerOf(bones, rows[kRightWrist]);
  return rows;
}

}  // namespace

absl::StatusOr<BoneMap> MapBones(const std::vector<FileBone>& bones) {
  BoneMap map;
  std::string missing;
  int most = -1;
  for (const JointNames* naming : KnownNamings()) {
    const JointRows rows = RowsOf(bones, *naming);
    const auto found = static_cast<int>(kHumanJoints - std::count(rows.begin(), rows.end(), -1));
    if (found <= most) continue;
    most = found;
    map.bone_of_joint = rows;
    const auto gap = std::find(rows.begin(), rows.end(), -1);
    if (gap != rows.end()) missing = (*naming)[gap - rows.begin()];
  }
  if (most < kHumanJoints) {
    return absl::InvalidArgumentError(fmt::format("no bone '{}' among the {}", missing, bones.size()));
  }
  map.joint_of_bone.assign(bones.size(), -1);
  for (int j = 0; j < kHumanJoints; ++j) map.joint_of_bone[map.bone_of_joint[j]] = j;
  for (size_t b = 0; b < bones.size(); ++b) {
    int& joint = map.joint_of_bone[b];
    if (joint >= 0) continue;
    joint = bones[b].parent < 0 ? kPelvis : map.joint_of_bone[bones[b].parent];
    if ((joint == kLeftWrist || joint == kRightWrist) && !IsThumb(bones[b].name) &&
        bones[b].parent == map.bone_of_joint[joint]) {
      joint = joint == kLeftWrist ? kLeftHand : kRightHand;
    }
  }
  return map;
}

}  // namespace stance
