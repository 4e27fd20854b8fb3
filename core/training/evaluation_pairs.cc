#include "core/training/evaluation_pairs.h"

#include <fmt/format.h>

#include <mutex>

#include "core/base/check.h"
#include "core/base/threads.h"
#include "core/transfer/bone_rotation_solver.h"
#include "core/transfer/linear_blend_skinning.h"

namespace stance {
namespace {

Points DeformSource(const TransferPair& pair, const Points& joints, const RowMatrix& weights,
                    const std::vector<Rotation>& rotations) {
  return LinearBlendSkinning().Deform(pair.source.mesh.positions, weights,
                                      PoseTransforms(HumanSkeleton(), joints, rotations));
}

}  // namespace

std::string PoseMixName(PoseMix mix) {
  switch (mix) {
    case PoseMix::kModerate:
      return "moderate";
    case PoseMix::kHard:
      return "hard";
    case PoseMix::kTraining:
      return "training";
  }
  STANCE_CHECK(false);
}

std::vector<Rotation> TrueRotations(const TransferPair& pair) {
  std::vector<Rotation> rotations(pair.source.rotations.size());
  for (size_t j = 0; j < rotations.size(); ++j) {
    rotations[j] = pair.reference.rotations[j] * pair.source.rotations[j].transpose();
  }
  return rotations;
}

std::vector<Candidate> ComposeParts(const TransferPair& pair, const TransferResult* method) {
  const Character &source = pair.source, &reference = pair.reference;
  const std::vector<Rotation> rotations = TrueRotations(pair);
  std::vector<Candidate> candidates;
  candidates.push_back({.method = "source left as it is", .positions = source.mesh.positions});
  if (method != nullptr) {
    candidates.push_back(
        {.method = "method with true rotations",
         .positions = DeformSource(pair, method->source_rig.joints, method->source_rig.weights, rotations)});
  } else {
    candidates.push_back({.method = "method with true rotations",
                          .positions = absl::FailedPreconditionError("the method itself failed")});
  }
  for (const Twist twist : {Twist::kPaper, Twist::kInherited}) {
    const std::vector<Rotation> solved =
        BoneRotationSolver(twist).Solve(HumanSkeleton(), source.mesh, {source.joints, source.weights},
                                        reference.mesh, {reference.joints, reference.weights});
    candidates.push_back({.method = twist == Twist::kPaper ? "true weights and joints, paper A's rotations"
                                                           : "true weights and joints, inherited twist",
                          .positions = DeformSource(pair, source.joints, source.weights, solved)});
  }
  candidates.push_back({.method = "true weights, joints and rotations",
                        .positions = DeformSource(pair, source.joints, source.weights, rotations)});
  return candidates;
}

std::vector<EvaluationRow> JudgePairs(
    const CharacterGenerator& generator, const PairEvaluationOptions& options,
    const std::function<std::vector<Candidate>(const TransferPair&)>& compose,
    const std::function<void(int)>& progress) {
  const int64_t count = static_cast<int64_t>(options.poses.size()) * options.pairs;
  std::vector<std::vector<EvaluationRow>> rows(static_cast<size_t>(count));
  std::mutex mutex;
  int done = 0;  // protected by mutex
  const auto evaluate = [&](int64_t item) {
    CharacterOptions characters = options.characters;
    characters.poses = options.poses[static_cast<size_t>(item / options.pairs)];
    const int64_t index = item % options.pairs;
    const TransferPair pair = generator.MakePair(options.seed, index, characters);
    const std::string name = fmt::format("{}-{}", PoseMixName(characters.poses), index);
    for (const Candidate& candidate : compose(pair)) {
      rows[static_cast<size_t>(item)].push_back(
          Judge(name, candidate, pair.truth, pair.source.mesh.faces, pair.source.stature));
    }
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress(done);
  };
  ParallelFor(count, options.threads, 1, [&](int64_t begin, int64_t end) {
    for (int64_t item = begin; item < end; ++item) evaluate(item);
  });

  std::vector<EvaluationRow> all;
  for (std::vector<EvaluationRow>& pair_rows : rows) {
    for (EvaluationRow& row : pair_rows) all.push_back(std::move(row));
  }
  return all;
}

std::vector<EvaluationRow> EvaluatePairs(const CharacterGenerator& generator, const Pipeline& pipeline,
                                         const PairEvaluationOptions& options,
                                         const std::function<void(int)>& progress) {
  const Method method = options.transfer.method.value_or(pipeline.models().front().method);
  const auto compose = [&](const TransferPair& pair) {
    const absl::StatusOr<TransferResult> result =
        pipeline.Transfer(pair.source.mesh, pair.reference.mesh, options.transfer);
    std::vector<Candidate> candidates = {MethodCandidate(method, result)};
    if (!options.parts) return candidates;
    for (Candidate& part : ComposeParts(pair, result.ok() ? &*result : nullptr)) {
      candidates.push_back(std::move(part));
    }
    return candidates;
  };
  return JudgePairs(generator, options, compose, progress);
}

}  // namespace stance
