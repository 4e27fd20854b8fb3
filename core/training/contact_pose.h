// Poses in which limbs touch the body: where networks confuse left with right and arm with trunk.
#pragma once

#include <vector>

#include "core/base/random.h"
#include "core/skeleton/kinematics.h"

namespace stance {

// Turns the shoulder and the elbow so that the wrist comes to `target` (metres, the character's frame), or as
// near as the arm reaches. The elbow bends about its own hinge; of the arm's swivels about the line from
// shoulder to target the one is taken that points the elbow most towards `elbow_hint`.
// `rest` (24, 3); `local` (24) local rotations, changed at the two joints only.
void ReachWith(bool left, const Eigen::Vector3f& target, const Eigen::Vector3f& elbow_hint,
               const Points& rest, std::vector<Rotation>& local);

// Lays hands on thighs, hips, chest, belly, head, the other arm, or along the sides: each arm draws its own
// place, or both do the same. Expects the trunk and the legs posed.
void PlaceHands(Random& random, const Points& rest, std::vector<Rotation>& local);

}  // namespace stance
