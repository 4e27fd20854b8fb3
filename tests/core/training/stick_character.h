// A character without data: a small box around each joint of a stick figure, bound rigidly to it.
#pragma once

#include <vector>

#include "core/training/character.h"

namespace stance::testing {

// Stature about 1.7 m, T pose, facing +z.
Character StickCharacter();

// The character with its joints turned by `global` rotations (24) about the rest pose; the pelvis stays.
Character Posed(const Character& rest, const std::vector<Rotation>& global);

}  // namespace stance::testing
