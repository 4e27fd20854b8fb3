// Frames of inputs against the canonical one (y up; docs/conventions.md).
#pragma once

#include <Eigen/Core>

#include "core/transfer/options.h"

namespace stance {

// The rotation from a frame whose `up` axis points up to the y-up frame: a column vector v becomes ToYUp(up)
// * v. For z up, z -> y and y -> -z (Blender's export rule); for x up, x -> y and y -> -x.
Eigen::Matrix3f ToYUp(UpAxis up);

}  // namespace stance
