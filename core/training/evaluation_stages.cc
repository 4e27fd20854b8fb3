#include "core/training/evaluation_stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <numeric>

#include "core/base/check.h"
#include "core/base/threads.h"
#include "core/training/evaluation_bones.h"

namespace stance {
namespace {

// The joints of one character as if it were kReferenceStature tall.
Points NormalisedJoints(const Points& joints, double stature) {
  return joints * static_cast<float>(kReferenceStature / stature);
}

// The rigid and the smooth rig of one mesh; the same network run twice, so that both come from the pipeline
// itself.
absl::StatusOr<std::array<Rig, 2>> RigidAndSmooth(const Pipeline& pipeline, const TriangleMesh& mesh,
                                                  const TransferOptions& options) {
  std::array<RigJob, 2> jobs = {RigJob{&mesh, options}, RigJob{&mesh, options}};
  jobs[0].options.smoothing.kind = SmoothingKind::kNone;
  std::vector<absl::StatusOr<RigResult>> results = pipeline.RigBatch(jobs);
  STANCE_CHECK(results.size() == 2);
  STANCE_RETURN_IF_ERROR(results[0].status());
  STANCE_RETURN_IF_ERROR(results[1].status());
  return std::array<Rig, 2>{std::move(results[0]->rig), std::move(results[1]->rig)};
}

// Adds to each mean its share of one of `count` values.
void Accumulate(WeightErrors& mean, const WeightErrors& one, double count) {
  mean.accuracy += one.accuracy / count;
  mean.l1 += one.l1 / count;
}

}  // namespace

WeightErrors CompareWeights(const RowMatrix& predicted, const RowMatrix& truth) {
  STANCE_CHECK(predicted.rows() == truth.rows() && predicted.cols() == truth.cols() && truth.rows() > 0);
  int64_t right = 0;
  for (Eigen::Index v = 0; v < truth.rows(); ++v) {
    Eigen::Index predicted_joint = 0, true_joint = 0;
    predicted.row(v).maxCoeff(&predicted_joint);
    truth.row(v).maxCoeff(&true_joint);
    right += predicted_joint == true_joint ? 1 : 0;
  }
  const auto count = static_cast<double>(truth.rows());
  return {.accuracy = static_cast<double>(right) / count,
          .l1 = (predicted - truth).cwiseAbs().cast<double>().sum() / count};
}

StageErrors EvaluateStages(const CharacterGenerator& generator, const Pipeline& pipeline,
                           const StageEvaluationOptions& options, const std::function<void(int)>& progress) {
  struct One {
    WeightErrors rigid, smooth;
    std::vector<double> joint_mm;  // empty: not rigged
    std::string failure;           // why not
  };
  std::vector<One> ones(static_cast<size_t>(options.characters));
  StageErrors errors;
  std::mutex mutex;  // protects done
  int done = 0;
  ParallelFor(options.characters, options.threads, 1, [&](int64_t begin, int64_t end) {
    for (int64_t index = begin; index < end; ++index) {
      const Character character = generator.Make(options.seed, index, options.character);
      const absl::StatusOr<std::array<Rig, 2>> rigs =
          RigidAndSmooth(pipeline, character.mesh, options.transfer);
      One& one = ones[static_cast<size_t>(index)];
      if (!rigs.ok()) {
        one.failure = fmt::format("character {}: {}", index, rigs.status().ToString());
      } else {
        one.rigid = CompareWeights((*rigs)[0].weights, character.weights);
        one.smooth = CompareWeights((*rigs)[1].weights, character.weights);
        const Eigen::VectorXd distances =
            VertexErrorsMm(NormalisedJoints((*rigs)[1].joints, character.stature),
                           NormalisedJoints(character.joints, character.stature));
        one.joint_mm.assign(distances.begin(), distances.end());
      }
      const std::lock_guard<std::mutex> lock(mutex);
      if (progress) progress(++done);
    }
  });

  for (const One& one : ones) {
    if (!one.failure.empty()) errors.failures.push_back(one.failure);
  }
  errors.characters = options.characters - static_cast<int>(errors.failures.size());
  errors.joint_mm.assign(static_cast<size_t>(pipeline.skeleton().joint_count()), 0.0);
  for (const One& one : ones) {
    if (one.joint_mm.empty()) continue;
    Accumulate(errors.rigid, one.rigid, errors.characters);
    Accumulate(errors.smooth, one.smooth, errors.characters);
    for (size_t j = 0; j < one.joint_mm.size(); ++j)
      errors.joint_mm[j] += one.joint_mm[j] / errors.characters;
  }
  errors.mean_joint_mm = std::accumulate(errors.joint_mm.begin(), errors.joint_mm.end(), 0.0) /
                         static_cast<double>(errors.joint_mm.size());
  const BoneEvaluation bones = EvaluateBones(generator, pipeline,
                                             {.seed = options.seed,
                                              .identities = options.identities,
                                              .poses_each = options.poses_each,
                                              .character = options.character,
                                              .transfer = options.transfer,
                                              .threads = options.threads});
  errors.failures.insert(errors.failures.end(), bones.failures.begin(), bones.failures.end());
  errors.bones = bones.table;
  return errors;
}

std::string StagesMarkdown(const StageErrors& errors, const Skeleton& skeleton) {
  std::string text = fmt::format(
      "| stage | value |\n|---|---|\n"
      "| characters | {} |\n"
      "| weight accuracy (largest weight), rigid | {:.2f} % |\n"
      "| weight accuracy (largest weight), smooth | {:.2f} % |\n"
      "| weight L1, rigid | {:.4f} |\n"
      "| weight L1, smooth | {:.4f} |\n"
      "| joint error, mean | {:.1f} mm |\n"
      "| bone length, mean | {:.4f} m |\n"
      "| bone length over poses, largest standard deviation | {:.4f} m |\n"
      "| bone length over poses, mean standard deviation | {:.4f} m |\n"
      "\n| joint | error mm |\n|---|---|\n",
      errors.characters, errors.rigid.accuracy * 100, errors.smooth.accuracy * 100, errors.rigid.l1,
      errors.smooth.l1, errors.mean_joint_mm, errors.bones.mean_length, errors.bones.max_deviation,
      errors.bones.mean_deviation);
  for (size_t j = 0; j < errors.joint_mm.size(); ++j) {
    text += fmt::format("| {} | {:.1f} |\n", skeleton.names()[j], errors.joint_mm[j]);
  }
  if (!errors.failures.empty()) text += fmt::format("\n{} failed:\n\n", errors.failures.size());
  for (const std::string& failure : errors.failures) text += fmt::format("- {}\n", failure);
  return text;
}

std::string StagesCsv(const StageErrors& errors, const Skeleton& skeleton, const std::string& poses) {
  std::string csv;
  const auto add = [&](const std::string& quantity, double value) {
    csv += fmt::format("{},{},{:.6g}\n", poses, quantity, value);
  };
  add("characters", errors.characters);
  add("rigid_accuracy", errors.rigid.accuracy);
  add("smooth_accuracy", errors.smooth.accuracy);
  add("rigid_l1", errors.rigid.l1);
  add("smooth_l1", errors.smooth.l1);
  add("joint_mm", errors.mean_joint_mm);
  add("bone_length_m", errors.bones.mean_length);
  add("bone_max_deviation_m", errors.bones.max_deviation);
  add("bone_mean_deviation_m", errors.bones.mean_deviation);
  for (size_t j = 0; j < errors.joint_mm.size(); ++j) {
    add("joint_mm_" + skeleton.names()[j], errors.joint_mm[j]);
  }
  return csv;
}

}  // namespace stance
