#include "core/skeleton/bone_names.h"

#include <fmt/format.h>

#include <array>

#include "core/base/check.h"
#include "core/skeleton/skeleton.h"

namespace stance {
namespace {

constexpr std::array<std::pair<BoneNaming, std::string_view>, 4> kNamings = {
    {{BoneNaming::kSmpl, "smpl"},
     {BoneNaming::kMixamo, "mixamo"},
     {BoneNaming::kVrm, "vrm"},
     {BoneNaming::kUnreal, "unreal"}}};

struct JointNames {
  const char* mixamo;
  const char* vrm;
  const char* unreal;
};

// A tool's "shoulder" is SMPL's collar, its "arm" SMPL's shoulder: bones are called after the part they move.
constexpr std::array<JointNames, kHumanJoints> kNames = {{
    {"Hips", "hips", "pelvis"},
    {"LeftUpLeg", "leftUpperLeg", "thigh_l"},
    {"RightUpLeg", "rightUpperLeg", "thigh_r"},
    {"Spine", "spine", "spine_01"},
    {"LeftLeg", "leftLowerLeg", "calf_l"},
    {"RightLeg", "rightLowerLeg", "calf_r"},
    {"Spine1", "chest", "spine_02"},
    {"LeftFoot", "leftFoot", "foot_l"},
    {"RightFoot", "rightFoot", "foot_r"},
    {"Spine2", "upperChest", "spine_03"},
    {"LeftToeBase", "leftToes", "ball_l"},
    {"RightToeBase", "rightToes", "ball_r"},
    {"Neck", "neck", "neck_01"},
    {"LeftShoulder", "leftShoulder", "clavicle_l"},
    {"RightShoulder", "rightShoulder", "clavicle_r"},
    {"Head", "head", "head"},
    {"LeftArm", "leftUpperArm", "upperarm_l"},
    {"RightArm", "rightUpperArm", "upperarm_r"},
    {"LeftForeArm", "leftLowerArm", "lowerarm_l"},
    {"RightForeArm", "rightLowerArm", "lowerarm_r"},
    {"LeftHand", "leftHand", "hand_l"},
    {"RightHand", "rightHand", "hand_r"},
    {"LeftHandMiddle1", "leftMiddleProximal", "middle_01_l"},
    {"RightHandMiddle1", "rightMiddleProximal", "middle_01_r"},
}};

std::vector<std::string> Collect(const char* prefix, const char* JointNames::*member) {
  std::vector<std::string> names;
  for (const JointNames& joint : kNames) names.push_back(std::string(prefix) + joint.*member);
  return names;
}

}  // namespace

const std::vector<std::string>& HumanBoneNames(BoneNaming naming) {
  static const std::vector<std::string> mixamo = Collect("mixamorig:", &JointNames::mixamo);
  static const std::vector<std::string> vrm = Collect("", &JointNames::vrm);
  static const std::vector<std::string> unreal = Collect("", &JointNames::unreal);
  switch (naming) {
    case BoneNaming::kSmpl:
      return HumanSkeleton().names();
    case BoneNaming::kMixamo:
      return mixamo;
    case BoneNaming::kVrm:
      return vrm;
    case BoneNaming::kUnreal:
      return unreal;
  }
  STANCE_CHECK(false);
}

std::string_view BoneNamingName(BoneNaming naming) {
  for (const auto& [known, name] : kNamings) {
    if (naming == known) return name;
  }
  STANCE_CHECK(false);
}

absl::StatusOr<BoneNaming> BoneNamingFromName(std::string_view name) {
  for (const auto& [naming, known] : kNamings) {
    if (name == known) return naming;
  }
  return absl::InvalidArgumentError(
      fmt::format("'{}' is no known bone naming (smpl, mixamo, vrm, unreal)", name));
}

}  // namespace stance
