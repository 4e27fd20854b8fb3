// What a method says of its own transfers' quality, and what was so by the truth.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/training/character_generator.h"
#include "core/training/reliability.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct ConfidenceEvaluationOptions {
  uint64_t seed = 1;
  int pairs = 100;  // of each pose mix
  std::vector<PoseMix> poses = {PoseMix::kModerate, PoseMix::kHard};
  CharacterOptions characters{.split = Split::kTest};  // the pose mix is set from `poses`
  TransferOptions transfer = {};
  int threads = 1;  // pairs at a time
};

// (J) 1 where the joint's rotation is within kRightDegrees and its place within kRightMillimetres (of a
// character of kReferenceStature) of the truth, else 0. REQUIRES: a rig with rotations.
Eigen::VectorXf RightJoints(const Rig& rig, const Character& truth);

// One transfer. The vectors are (J); of the arrays, the first is the source's, the second the reference's.
struct ConfidenceObservation {
  std::string poses;            // the mix
  int64_t index = 0;            // of the pair in the mix
  std::string failure = {};     // why there is no transfer; the rest is then empty
  double mean_mm = 0;           // over vertices, of a source of kReferenceStature
  Eigen::VectorXf shares = {};  // of the source's surface (core/transfer/confidence.h)
  std::array<Eigen::VectorXf, 2> confidence = {};
  std::array<Eigen::VectorXf, 2> right = {};  // RightJoints
};

// Of every pair of every pose mix, in order. FAILED_PRECONDITION if the method does not know its confidence.
// `progress`, if set, is called with the number of pairs done, from any of the threads, one at a time.
absl::StatusOr<std::vector<ConfidenceObservation>> ObserveConfidence(
    const CharacterGenerator& generator, const Pipeline& pipeline, const ConfidenceEvaluationOptions& options,
    const std::function<void(int)>& progress = {});

// The calls below leave out observations that failed.

// Of each joint of each source and reference: that it is right.
std::vector<Claim> JointClaims(const std::vector<ConfidenceObservation>& observations);
// Likewise, of one joint.
std::vector<Claim> JointClaims(const std::vector<ConfidenceObservation>& observations, int joint);

// Of each transfer, behind the calibration: the share of the source's surface that follows right joints.
std::vector<Claim> TransferClaims(const std::vector<ConfidenceObservation>& observations,
                                  const ConfidenceCalibration& calibration = {});

// The transfers with at least this confidence.
struct KeptTransfers {
  double least = 0;
  double share = 0;     // of all transfers
  double mean_mm = 0;   // over kept transfers of their mean errors; 0 where none is kept, as below
  double p95_mm = 0;    // 95th percentile over kept transfers of their mean errors
  double worst_mm = 0;  // largest of their mean errors
};

// For each threshold what a caller keeps who rejects what is less sure.
std::vector<KeptTransfers> KeptAbove(const std::vector<ConfidenceObservation>& observations,
                                     const std::vector<double>& thresholds,
                                     const ConfidenceCalibration& calibration = {});

}  // namespace stance
