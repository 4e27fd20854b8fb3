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

// 3ds Max's biped, which counts fingers from the thumb and its spine from the bone above the pelvis.
const JointNames kBiped = {"Bip01 Pelvis",     "Bip01 L Thigh",    "Bip01 R Thigh",    "Bip01 Spine",
                           "Bip01 L Calf",     "Bip01 R Calf",     "Bip01 Spine1",     "Bip01 L Foot",
                           "Bip01 R Foot",     "Bip01 Spine2",     "Bip01 L Toe0",     "Bip01 R Toe0",
                           "Bip01 Neck",       "Bip01 L Clavicle", "Bip01 R Clavicle", "Bip01 Head",
                           "Bip01 L UpperArm", "Bip01 R UpperArm", "Bip01 L Forearm",  "Bip01 R Forearm",
                           "Bip01 L Hand",     "Bip01 R Hand",     "Bip01 L Finger2",  "Bip01 R Finger2"};

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

int RowOf(const std::vector<FileBone>& bones, std::string_view name) {
  const auto bone =
      std::find_if(bones.begin(), bones.end(), [&](const FileBone& b) { return b.name == name; });
  return bone == bones.end() ? -1 : static_cast<int>(bone - bones.begin());
}

bool IsThumb(std::string name) {
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name.find("thumb") != std::string::npos || name.find("finger0") != std::string::npos;
}

}  // namespace

absl::StatusOr<BoneMap> MapBones(const std::vector<FileBone>& bones) {
  BoneMap map;
  std::string missing;
  int most = -1;
  for (const JointNames* naming : KnownNamings()) {
    std::array<int, kHumanJoints> rows;
    std::transform(naming->begin(), naming->end(), rows.begin(),
                   [&](const std::string& name) { return RowOf(bones, name); });
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
