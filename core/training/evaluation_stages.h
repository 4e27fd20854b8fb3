// How good the stages before the deformation are: the weights and the joints of the rigger.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/mesh/metrics.h"
#include "core/training/character_generator.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct StageEvaluationOptions {
  uint64_t seed = 1;
  int characters = 100;
  int identities = 10;  // for the bone lengths, each in `poses_each` poses
  int poses_each = 20;
  CharacterOptions character{.poses = PoseMix::kModerate, .split = Split::kTest};
  TransferOptions transfer = {};  // the smoothing is the one whose result is judged
  int threads = 1;                // characters at a time
};

// Weights (V, J) against the truth's.
struct WeightErrors {
  double accuracy = 0;  // fraction of vertices whose largest weight is the truth's largest
  double l1 = 0;        // mean over vertices of sum_j |w - w^|, 0..2
};
WeightErrors CompareWeights(const RowMatrix& predicted, const RowMatrix& truth);

// Means over characters of kReferenceStature.
struct StageErrors {
  int characters = 0;  // that were rigged
  // "character 17: ..." for the others, then "identity 3: ..." for poses without bone lengths; in order of
  // index.
  std::vector<std::string> failures;
  WeightErrors rigid;  // before smoothing
  WeightErrors smooth;
  std::vector<double> joint_mm;  // (J)
  double mean_joint_mm = 0;
  // Paper A's table 1 per identity, then the mean over identities of each figure.
  BoneLengthDeviation bones;
};

// `progress`, if set, is called with the number of characters done, from any of the threads, one at a time.
StageErrors EvaluateStages(const CharacterGenerator& generator, const Pipeline& pipeline,
                           const StageEvaluationOptions& options,
                           const std::function<void(int)>& progress = {});

std::string StagesMarkdown(const StageErrors& errors, const Skeleton& skeleton);
// What the markdown shows as lines "poses,quantity,value" with six digits; no header.
std::string StagesCsv(const StageErrors& errors, const Skeleton& skeleton, const std::string& poses);

}  // namespace stance
