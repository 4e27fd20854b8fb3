// Skeletons, weights, transforms and timings between the contract's messages and core's values.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/base/types.h"
#include "core/skeleton/kinematics.h"
#include "core/transfer/pipeline.h"
#include "google/protobuf/repeated_field.h"
#include "stance/v1/pose_transfer.pb.h"
#include "stance/v1/rig.pb.h"

namespace stance {

// A placed skeleton as it travels: J names and parents, joints (J, 3), confidence (J) or empty.
struct PlacedSkeleton {
  std::vector<std::string> names;
  std::vector<int> parents;
  Points joints;
  Eigen::VectorXf confidence;
};

// REQUIRES: as many names, parents and joints, and confidences or none.
void SkeletonToWire(const std::vector<std::string>& names, const std::vector<int>& parents,
                    const Points& joints, const Eigen::VectorXf& confidence, v1::Skeleton* wire);

// INVALID_ARGUMENT, naming the field, if the counts differ, a parent does not precede its child, or a
// confidence is not in [0, 1].
absl::StatusOr<PlacedSkeleton> SkeletonFromWire(const v1::Skeleton& wire);

// Keeps the positive entries of each row of (V, J), in descending order (equal ones by joint).
void WeightsToWire(const RowMatrix& weights, v1::SkinWeights* wire);

// The dense (V, J) matrix. INVALID_ARGUMENT, naming the field, for arrays of the wrong length, offsets that
// are not ascending from 0 to N, a joint index out of range, or a matrix of more than 2^31 entries.
absl::StatusOr<RowMatrix> WeightsFromWire(const v1::SkinWeights& wire);

// (J, 3, 4) row-major [linear | translation].
void TransformsToWire(std::span<const AffineTransform> transforms,
                      google::protobuf::RepeatedField<float>* wire);
// INVALID_ARGUMENT if the length is not a multiple of 12.
absl::StatusOr<std::vector<AffineTransform>> TransformsFromWire(
    const google::protobuf::RepeatedField<float>& wire);

// Core's phases; the server's own (queue, decode, encode) and the total are left alone.
void PhasesToWire(const PhaseSeconds& seconds, v1::PhaseTimings* wire);
// Core's phases and the total.
PhaseSeconds PhasesFromWire(const v1::PhaseTimings& wire);

}  // namespace stance
