// Random poses of the canonical skeleton.
#pragma once

#include <vector>

#include "core/base/random.h"
#include "core/skeleton/kinematics.h"
#include "core/training/character_generator.h"
#include "core/training/motion_library.h"

namespace stance {

// A pose of the mix as local rotations (24); the body faces +z (the root's own rotation is a clip's lean, or
// none). `rest` (24, 3) are the joints of the body it is made for: contacts are exact on that one only.
std::vector<Rotation> SamplePose(Random& random, PoseMix mix, const MotionLibrary& motions, Split split,
                                 const Points& rest);

// A rotation of the whole body: yaw over the full circle, tilts about x and z of 15 degrees' deviation, any
// tilt up to a right angle for one character in twelve.
Rotation SampleGlobalTurn(Random& random);

}  // namespace stance
