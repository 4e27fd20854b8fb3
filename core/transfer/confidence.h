// How sure a transfer is of itself.
#pragma once

#include <optional>

#include "core/mesh/triangle_mesh.h"
#include "core/network/model_manifest.h"
#include "core/transfer/parts.h"

namespace stance {

// log(p / (1 - p)), p kept 1e-6 away from 0 and 1, where the float of a saturated sigmoid would make it
// infinite.
double Logit(double probability);

// sigmoid(scale logit(p) + bias); p itself by the default calibration. REQUIRES: p in [0, 1].
double CalibratedConfidence(double probability, const ConfidenceCalibration& calibration);

// (J) the share of the surface that each joint moves: the mean of W's rows, each weighted by its vertex's
// area (by nothing, where the mesh has none). They sum to 1. REQUIRES: a row of `weights` (V, J) per vertex.
Eigen::VectorXf JointShares(const Points& positions, const Faces& faces, const RowMatrix& weights);

// The share of the source's surface that is expected to follow joints which are right in both characters,
// whose mistakes are taken for independent: sum_j share_j source_j reference_j, in [0, 1]. Nothing if either
// rig does not know its confidence. REQUIRES: vectors (J) or empty.
std::optional<float> TransferConfidence(const Eigen::VectorXf& shares, const Eigen::VectorXf& source,
                                        const Eigen::VectorXf& reference);

}  // namespace stance
