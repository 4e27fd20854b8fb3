// The evaluation of transfer pairs with ground truth: the method itself, and what its parts could reach.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/training/character_generator.h"
#include "core/training/evaluation.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct PairEvaluationOptions {
  uint64_t seed = 1;
  int pairs = 100;  // of each pose mix
  std::vector<PoseMix> poses = {PoseMix::kModerate, PoseMix::kHard};
  CharacterOptions characters{.split = Split::kTest};  // the pose mix is set from `poses`
  TransferOptions transfer = {};
  bool parts = true;  // also the compositions that ComposeParts makes
  int threads = 1;    // pairs at a time
};

// "moderate", "hard" or "training".
std::string PoseMixName(PoseMix mix);

// (24) the rotation that takes each joint of the source's pose to the reference's: R_ref R_src^T.
std::vector<Rotation> TrueRotations(const TransferPair& pair);

// What the transfer could reach with parts of the truth in place of the method's own; they tell which part an
// error comes from. All but the first deform the source by linear blend skinning:
//  - the source left as it is (its pelvis is where the truth's is);
//  - `method` with true rotations, unless `method` is null (a failed transfer);
//  - true weights and joints, rotations from bone directions (paper A's Algorithm 1), with each kind of
//  twist;
//  - true weights, joints and rotations: what skinning a posed source can reach at all.
std::vector<Candidate> ComposeParts(const TransferPair& pair, const TransferResult* method);

// Rows of every pair of every pose mix, in order; each pair has the same rows in the same order: what
// `compose` makes of it, on any of the threads. `progress`, if set, is called with the number of pairs done,
// from any of the threads, one at a time.
std::vector<EvaluationRow> JudgePairs(
    const CharacterGenerator& generator, const PairEvaluationOptions& options,
    const std::function<std::vector<Candidate>(const TransferPair&)>& compose,
    const std::function<void(int)>& progress = {});

// JudgePairs of the method, which comes first, and of ComposeParts where the options ask for it.
std::vector<EvaluationRow> EvaluatePairs(const CharacterGenerator& generator, const Pipeline& pipeline,
                                         const PairEvaluationOptions& options,
                                         const std::function<void(int)>& progress = {});

}  // namespace stance
