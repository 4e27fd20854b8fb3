// The human joints under the names that other tools know them by.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace stance {

enum class BoneNaming {
  kSmpl,    // "pelvis", "left_hip", ...: the names of HumanSkeleton()
  kMixamo,  // "mixamorig:Hips", ...; joints 22 and 23 are "mixamorig:LeftHandMiddle1" and
            // "...RightHandMiddle1"
  kVrm,     // VRM 1.0's humanoid bones: "hips", "leftUpperLeg", ...
  kUnreal,  // the Unreal Engine mannequin's: "pelvis", "thigh_l", ...
};

// One name per human joint, in the order of HumanJoint, all different.
const std::vector<std::string>& HumanBoneNames(BoneNaming naming);

// The naming's own name in commands and requests: "smpl", "mixamo", "vrm" or "unreal".
std::string_view BoneNamingName(BoneNaming naming);
// INVALID_ARGUMENT, listing the known ones, for any other name.
absl::StatusOr<BoneNaming> BoneNamingFromName(std::string_view name);

}  // namespace stance
