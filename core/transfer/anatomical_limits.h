// Knees and elbows that do not bend backwards.
#pragma once

#include <numbers>
#include <vector>

#include "core/skeleton/kinematics.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// How far past straight a hinge may go, in radians.
struct HingeLimit {
  float free = 8 * std::numbers::pi_v<float> / 180;    // left as it is: joint limits differ, rest poses too
  float margin = 6 * std::numbers::pi_v<float> / 180;  // > 0; what more there is at most
};

// The global rotations (24) from the rest (T) pose, with hyperextended knees and elbows drawn back: an angle
// past straight of `free + e` becomes free + margin tanh(e / margin). The turn is about the hinge in the
// parent's frame (knees x, elbows y), so the joint's twist and its swing across the hinge stay, and so do all
// other joints' global rotations. Hinges within `free` stay the same to the bit.
//
// The pull fades out where the limb points more than 20 to 37 degrees off straight backwards: then it is the
// parent's twist that is wrong, not the bend. Continuous but for a limb folded onto itself, where bent and
// hyperextended meet. REQUIRES: rotations of the human skeleton.
std::vector<Rotation> WithinAnatomicalLimits(std::vector<Rotation> global, const HingeLimit& limit = {});

}  // namespace stance
