// What each part of METHOD_STANCE is worth: the method with one part at a time left out, or replaced by the
// truth.
#pragma once

#include <vector>

#include "core/network/pose_model.h"
#include "core/training/character_generator.h"
#include "core/training/evaluation.h"

namespace stance {

// The whole method first; then without the mean over views, the fit of the joints, the correction of the
// rotations by the bones, the learned rotations (bone directions in their place, with each kind of twist) and
// the screened weights (a vertex has those of the sample in whose cell it lies); then with true joints,
// weights, rotations and each two of them. The networks are the same throughout.
std::vector<Candidate> AblateStance(const PoseModel& model, const TransferPair& pair);

}  // namespace stance
