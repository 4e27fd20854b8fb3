#include "core/training/evaluation_bones.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/base/check.h"
#include "core/base/threads.h"

namespace stance {
namespace {

// (poses) the lengths of the bone that ends in `joint`, millimetres.
Eigen::ArrayXd LengthsMm(const std::vector<Points>& joints, int joint, int parent) {
  Eigen::ArrayXd lengths(std::ssize(joints));
  for (Eigen::Index p = 0; p < lengths.size(); ++p) {
    const Points& pose = joints[static_cast<size_t>(p)];
    lengths[p] = (pose.row(joint) - pose.row(parent)).cast<double>().norm() * 1000;
  }
  return lengths;
}

// Applies `add` to each pair of fields.
template <class Add>
void ForEachField(BoneErrors& a, const BoneErrors& b, Add add) {
  add(a.length_mm, b.length_mm);
  add(a.true_mm, b.true_mm);
  add(a.deviation_mm, b.deviation_mm);
  add(a.variation, b.variation);
  add(a.error_mm, b.error_mm);
}

BoneErrors Mean(const std::vector<BoneErrors>& values) {
  BoneErrors mean;
  const auto count = static_cast<double>(values.size());
  for (const BoneErrors& value : values) {
    ForEachField(mean, value, [count](double& a, double b) { a += b / count; });
  }
  return mean;
}

// The joints of one identity's poses, as if it were kReferenceStature tall.
struct Poses {
  std::vector<Points> predicted, truth;
  std::vector<std::string> failures;
};

Poses RigPoses(const CharacterGenerator& generator, const Pipeline& pipeline,
               const BoneEvaluationOptions& options, int64_t identity) {
  Poses poses;
  TransferOptions transfer = options.transfer;
  transfer.smoothing.kind = SmoothingKind::kNone;
  for (const Character& character :
       generator.MakePoses(options.seed, identity, options.poses_each, options.character)) {
    const absl::StatusOr<RigResult> rig = pipeline.RigMesh(character.mesh, transfer);
    if (!rig.ok()) {
      poses.failures.push_back(fmt::format("identity {}: {}", identity, rig.status().ToString()));
      continue;
    }
    const auto scale = static_cast<float>(kReferenceStature / character.stature);
    poses.predicted.push_back(rig->rig.joints * scale);
    poses.truth.push_back(character.joints * scale);
  }
  return poses;
}

std::string CsvLine(const std::string& method, const std::string& poses, const std::string& bone,
                    const BoneErrors& errors) {
  return fmt::format("{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n", method, poses, bone, errors.length_mm,
                     errors.true_mm, errors.deviation_mm, errors.variation, errors.error_mm);
}

// "left_hip to left_knee": the bones in the joints' order.
std::vector<std::string> BoneNames(const Skeleton& skeleton) {
  std::vector<std::string> names;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    if (skeleton.parents()[j] < 0) continue;
    names.push_back(fmt::format("{} to {}", skeleton.names()[skeleton.parents()[j]], skeleton.names()[j]));
  }
  return names;
}

}  // namespace

std::vector<BoneErrors> CompareBones(const std::vector<Points>& predicted, const std::vector<Points>& truth,
                                     const std::vector<int>& parents) {
  STANCE_CHECK(predicted.size() == truth.size());
  std::vector<BoneErrors> bones;
  for (int j = 0; j < std::ssize(parents) && !predicted.empty(); ++j) {
    if (parents[j] < 0) continue;
    const Eigen::ArrayXd lengths = LengthsMm(predicted, j, parents[j]),
                         right = LengthsMm(truth, j, parents[j]);
    BoneErrors bone{.length_mm = lengths.mean(), .true_mm = right.mean()};
    bone.deviation_mm = std::sqrt((lengths - bone.length_mm).square().mean());
    bone.variation = bone.length_mm > 0 ? bone.deviation_mm / bone.length_mm : 0;
    bone.error_mm = (lengths - right).abs().mean();
    bones.push_back(bone);
  }
  return bones;
}

std::vector<BoneErrors> MeanBones(const std::vector<std::vector<BoneErrors>>& values) {
  if (values.empty()) return {};
  std::vector<BoneErrors> mean(values.front().size());
  const auto count = static_cast<double>(values.size());
  for (const std::vector<BoneErrors>& bones : values) {
    STANCE_CHECK(bones.size() == mean.size());
    for (size_t b = 0; b < mean.size(); ++b) {
      ForEachField(mean[b], bones[b], [count](double& a, double x) { a += x / count; });
    }
  }
  return mean;
}

BoneEvaluation EvaluateBones(const CharacterGenerator& generator, const Pipeline& pipeline,
                             const BoneEvaluationOptions& options, const std::function<void(int)>& progress) {
  std::vector<Poses> identities(static_cast<size_t>(std::max(0, options.identities)));
  std::mutex mutex;  // protects done
  int done = 0;
  ParallelFor(options.identities, options.threads, 1, [&](int64_t begin, int64_t end) {
    for (int64_t identity = begin; identity < end; ++identity) {
      identities[static_cast<size_t>(identity)] = RigPoses(generator, pipeline, options, identity);
      const std::lock_guard<std::mutex> lock(mutex);
      if (progress) progress(++done);
    }
  });

  BoneEvaluation result;
  const std::vector<int>& parents = pipeline.skeleton().parents();
  std::vector<std::vector<BoneErrors>> bones;
  std::vector<BoneLengthDeviation> tables;
  for (const Poses& poses : identities) {
    result.failures.insert(result.failures.end(), poses.failures.begin(), poses.failures.end());
    result.poses += static_cast<int>(poses.predicted.size());
    if (poses.predicted.empty()) continue;
    bones.push_back(CompareBones(poses.predicted, poses.truth, parents));
    tables.push_back(CompareBoneLengths(poses.predicted, parents));
  }
  result.bones = MeanBones(bones);
  result.overall = Mean(result.bones);
  const auto count = static_cast<double>(tables.size());
  for (const BoneLengthDeviation& table : tables) {
    result.table.mean_length += table.mean_length / count;
    result.table.max_deviation += table.max_deviation / count;
    result.table.mean_deviation += table.mean_deviation / count;
  }
  return result;
}

std::string BonesHeader() {
  return "| method | Avg Length m | Max Std m | Avg Std m | meshes | true length mm | std mm | variation % | "
         "length error mm |\n|---|---|---|---|---|---|---|---|---|\n"
         "| paper A, table 1 as printed (its own SMPL meshes) | 0.2008 | 0.0106 | 0.0061 | | | | | |\n";
}

std::string BonesRow(const std::string& name, const BoneEvaluation& evaluation) {
  const BoneErrors& all = evaluation.overall;
  const std::string meshes = evaluation.failures.empty() ? fmt::format("{}", evaluation.poses)
                                                         : fmt::format("{} (+{} failed)", evaluation.poses,
                                                                       evaluation.failures.size());
  return fmt::format("| {} | {:.4f} | {:.4f} | {:.4f} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", name,
                     evaluation.table.mean_length, evaluation.table.max_deviation,
                     evaluation.table.mean_deviation, meshes, all.true_mm, all.deviation_mm,
                     all.variation * 100, all.error_mm);
}

std::string BonesMarkdown(const BoneEvaluation& evaluation, const Skeleton& skeleton) {
  const std::vector<std::string> names = BoneNames(skeleton);
  std::string text =
      "| bone | length mm | true mm | std mm | variation % | length error mm |\n|---|---|---|---|---|---|\n";
  for (size_t b = 0; b < evaluation.bones.size(); ++b) {
    const BoneErrors& bone = evaluation.bones[b];
    text += fmt::format("| {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", names[b], bone.length_mm,
                        bone.true_mm, bone.deviation_mm, bone.variation * 100, bone.error_mm);
  }
  if (!evaluation.failures.empty()) text += fmt::format("\n{} failed:\n\n", evaluation.failures.size());
  for (const std::string& failure : evaluation.failures) text += fmt::format("- {}\n", failure);
  return text;
}

std::string BonesCsv(const std::string& method, const std::string& poses, const BoneEvaluation& evaluation,
                     const Skeleton& skeleton) {
  const std::vector<std::string> names = BoneNames(skeleton);
  std::string csv;
  for (size_t b = 0; b < evaluation.bones.size(); ++b) {
    csv += CsvLine(method, poses, names[b], evaluation.bones[b]);
  }
  csv += CsvLine(method, poses, "all", evaluation.overall);
  return csv +
         fmt::format("{},{},table1_max,,,{:.6g},,\n", method, poses, evaluation.table.max_deviation * 1000);
}

}  // namespace stance
