// Anatomical ranges of the canonical joints.
#pragma once

#include <array>

#include "core/skeleton/kinematics.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// Degrees about x, y and z.
struct EulerAngles {
  double x = 0;
  double y = 0;
  double z = 0;
};

struct AngleRange {
  double low = 0;
  double high = 0;
};

// A joint's ranges about x, y and z, for the left side and the midline. In the rest pose's axes: a hip bends
// the thigh forward by negative x and spreads it by positive z; a knee bends by positive x; a shoulder lowers
// the arm by negative z and brings it forward by negative y; an elbow bends by negative y.
const std::array<AngleRange, 3>& JointRange(int joint);

// The local rotation with these angles. Joints on the right take them mirrored (y and z change sign), so the
// same angles mean the same movement on both sides. The order of the axes is the joint's: along the arm and
// the thigh the twist comes first.
Rotation JointRotation(int joint, const EulerAngles& degrees);

}  // namespace stance
