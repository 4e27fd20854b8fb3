// How steady a rigger's bones are over the poses of one identity (paper A's table 1), and how right.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/mesh/metrics.h"
#include "core/training/character_generator.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct BoneEvaluationOptions {
  uint64_t seed = 1;
  int identities = 10;
  int poses_each = 20;
  CharacterOptions character{.poses = PoseMix::kModerate, .split = Split::kTest};
  TransferOptions transfer = {};  // the method; the weights don't matter
  int threads = 1;                // identities at a time
};

// Of one bone over the poses of one identity, or a mean of such figures. A bone goes from a joint's parent to
// the joint.
struct BoneErrors {
  double length_mm = 0;     // mean predicted length
  double true_mm = 0;       // mean true length
  double deviation_mm = 0;  // standard deviation (population) of the predicted length
  double variation = 0;     // coefficient of variation: deviation / mean length; 0 for a length of 0
  double error_mm = 0;      // mean |predicted - true length|
};

// One entry per joint with a parent, in the joints' order, over poses with joints (J, 3) in metres.
// REQUIRES: as many predicted poses as true ones.
std::vector<BoneErrors> CompareBones(const std::vector<Points>& predicted, const std::vector<Points>& truth,
                                     const std::vector<int>& parents);

// Each entry's mean over `values`, which have the same length; empty for none.
std::vector<BoneErrors> MeanBones(const std::vector<std::vector<BoneErrors>>& values);

// Means over identities; lengths are those of characters of kReferenceStature.
struct BoneEvaluation {
  int poses = 0;                      // that were rigged
  std::vector<std::string> failures;  // "identity 3: ..." for the others, in order of identity
  std::vector<BoneErrors> bones;      // as CompareBones; empty if nothing was rigged
  BoneErrors overall;                 // mean over bones
  BoneLengthDeviation table;          // paper A's table 1 per identity, then the mean of each figure
};

// `progress`, if set, is called with the number of identities done, from any of the threads, one at a time.
BoneEvaluation EvaluateBones(const CharacterGenerator& generator, const Pipeline& pipeline,
                             const BoneEvaluationOptions& options,
                             const std::function<void(int)>& progress = {});

// Paper A's table 1 with its own row, to which BonesRow adds. Its three columns in metres come first.
std::string BonesHeader();
// One line, "name" in the first column.
std::string BonesRow(const std::string& name, const BoneEvaluation& evaluation);
// A table with a line per bone, and the failures.
std::string BonesMarkdown(const BoneEvaluation& evaluation, const Skeleton& skeleton);
// What both tables show as lines "method,poses,bone,length_mm,true_mm,deviation_mm,variation,error_mm"; the
// bone "all" is the mean over bones, and "table1_max" has the deviation of paper A's Max Std alone. No
// header.
std::string BonesCsv(const std::string& method, const std::string& poses, const BoneEvaluation& evaluation,
                     const Skeleton& skeleton);

}  // namespace stance
