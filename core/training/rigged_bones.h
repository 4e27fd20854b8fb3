// Which of the canonical joints the bones of other tools' human rigs belong to.
#pragma once

#include <array>
#include <vector>

#include "core/base/status.h"
#include "core/skeleton/skeleton.h"
#include "core/training/rigged_mesh.h"

namespace stance {

struct BoneMap {
  std::vector<int> joint_of_bone;               // (B) the canonical joint that gets the bone's weights
  std::array<int, kHumanJoints> bone_of_joint;  // the bone that begins at the joint
};

// Knows 3ds Max's biped, Rigify's deformation bones and the namings of core/skeleton/bone_names.h. A bone
// without a joint of its own belongs to its parent's (face to head, twist to limb), one above the pelvis to
// the pelvis; fingers belong to the hand but thumbs to the wrist, as MPFB's do (mpfb_files.h). A
// hand without a middle finger begins at another one.
// INVALID_ARGUMENT, with a name, if no naming has all 24. REQUIRES: parents first.
absl::StatusOr<BoneMap> MapBones(const std::vector<FileBone>& bones);

}  // namespace stance
