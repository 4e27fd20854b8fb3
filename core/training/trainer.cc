#include "core/training/trainer.h"

#include <ATen/Parallel.h>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "core/network/model_files.h"
#include "core/network/pose_network.h"
#include "core/network/rigging_branch.h"
#include "core/network/skeletal_networks.h"
#include "core/network/transfer_branch.h"
#include "core/training/checkpoint.h"
#include "core/training/learner.h"
#include "core/training/training_log.h"

namespace stance {
namespace {

using Seconds = std::chrono::duration<double>;
using SteadyClock = std::chrono::steady_clock;

std::filesystem::path CheckpointPath(const std::filesystem::path& dir, TrainingStage stage) {
  return dir / (TrainingStageName(stage) + ".ckpt");
}

constexpr double kLongestGradient = 2;

// What a stage counts.
const char* Unit(TrainingStage stage) {
  return TrainingStageMethod(stage) == kNeuralMethod ? "pairs" : "characters";
}

double CosineRate(const TrainingOptions& options, int64_t seen) {
  const double done = std::min(1.0, static_cast<double>(seen) / static_cast<double>(options.total_samples));
  const double cosine = 0.5 * (1 + std::cos(std::numbers::pi * done));
  return options.learning_rate * (options.final_rate + (1 - options.final_rate) * cosine);
}

// Where a stage begins.
TrainingProgress NoProgress(const TrainingOptions& options) {
  return {0, options.samples_per_mesh, options.max_ring, 0, options.features};
}

// Refuses a checkpoint that saw other meshes than `expected` says: its networks would see what they never
// learned.
absl::Status CheckSameSamples(const std::filesystem::path& checkpoint, const TrainingProgress& found,
                              const TrainingProgress& expected) {
  const auto features = [](const InputFeatures& of) {
    return fmt::format("{} normals and {} neighbourhoods", of.normals ? "with" : "without",
                       of.geodesic ? "geodesic" : "euclidean");
  };
  if (found.features != expected.features) {
    return absl::FailedPreconditionError(fmt::format("{} was trained {}, not {}", checkpoint.string(),
                                                     features(found.features), features(expected.features)));
  }
  if (found.samples_per_mesh == expected.samples_per_mesh && found.max_ring == expected.max_ring) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(fmt::format(
      "{} was trained on {} samples per mesh with {} neighbours each, not {} with {}", checkpoint.string(),
      found.samples_per_mesh, found.max_ring, expected.samples_per_mesh, expected.max_ring));
}

// Loads a module as its stage has left it.
absl::StatusOr<TrainingProgress> LoadStage(const std::filesystem::path& dir, TrainingStage stage,
                                           const NamedModules::value_type& module, torch::Device device) {
  const auto loaded = LoadCheckpoint(CheckpointPath(dir, stage), {module}, nullptr, device);
  if (loaded.ok()) return loaded;
  return absl::FailedPreconditionError(fmt::format("stage '{}' must have been trained: {}",
                                                   TrainingStageName(stage),
                                                   std::string(loaded.status().message())));
}

// Two stages that each train one of the modules that a third goes on with.
using StagePair = std::array<TrainingStage, 2>;
constexpr StagePair kBeforeBoth = {TrainingStage::kWeights, TrainingStage::kJoints};
constexpr StagePair kBeforeWhole = {TrainingStage::kRigging, TrainingStage::kTransfer};

// Loads the stages' checkpoints into `modules`, one each, which must have seen the same meshes; returns the
// second's progress.
absl::StatusOr<TrainingProgress> LoadStages(const std::filesystem::path& dir, const StagePair& stages,
                                            const NamedModules& modules, torch::Device device) {
  std::optional<TrainingProgress> progress;
  for (const size_t i : {0, 1}) {
    const auto path = CheckpointPath(dir, stages[i]);
    STANCE_ASSIGN_OR_RETURN(const TrainingProgress loaded, LoadStage(dir, stages[i], modules[i], device));
    if (progress) STANCE_RETURN_IF_ERROR(CheckSameSamples(path, loaded, *progress));
    progress = loaded;
  }
  return *progress;
}

absl::Status CheckOptions(const TrainingOptions& options) {
  struct Whole {
    const char* name;
    int64_t value, least, most;
  };
  constexpr int64_t kAny = std::numeric_limits<int64_t>::max();
  // Samples and neighbours are part of the model: the bounds are those of its manifest.
  for (const Whole& option :
       {Whole{"samples_per_mesh", options.samples_per_mesh, 64, 100'000},
        Whole{"max_ring", options.max_ring, 1, 64}, Whole{"batch_size", options.batch_size, 1, 4096},
        Whole{"total_samples", options.total_samples, 1, kAny},
        Whole{"loss_points", options.loss_points, 1, kAny}, Whole{"reuse", options.reuse, 1, 1000},
        Whole{"threads", options.threads, 1, 1024},
        Whole{"generator_threads", options.generator_threads, 1, 1024}}) {
    if (option.value >= option.least && option.value <= option.most) continue;
    return absl::InvalidArgumentError(
        option.most == kAny
            ? fmt::format("{}: {} is less than {}", option.name, option.value, option.least)
            : fmt::format("{}: {} is not in {}..{}", option.name, option.value, option.least, option.most));
  }
  struct Real {
    const char* name;
    double value, most;
    bool zero;  // is allowed
  };
  constexpr double kFinite = std::numeric_limits<double>::max();
  for (const Real& option : {Real{"learning_rate", options.learning_rate, kFinite, false},
                             Real{"final_rate", options.final_rate, 1, true},
                             Real{"checkpoint_minutes", options.checkpoint_minutes, kFinite, true},
                             Real{"max_hours", options.max_hours, kFinite, true}}) {
    // Written so that a NaN is refused too.
    if ((option.value > 0 || (option.zero && option.value == 0)) && option.value <= option.most) continue;
    return absl::InvalidArgumentError(fmt::format("{}: {} is out of range", option.name, option.value));
  }
  if (options.device != "cpu" && options.device != "cuda" && !options.device.starts_with("cuda:")) {
    return absl::InvalidArgumentError(fmt::format("device: '{}' is neither cpu nor cuda", options.device));
  }
  return absl::OkStatus();
}

// Stage "refinement" sees what the first network, as exported, makes of the characters, and stage "transfer"
// what the rigging branch finds in them.
absl::StatusOr<std::unique_ptr<Learner>> MakeLearner(const CharacterGenerator& generator,
                                                     const TrainingOptions& options) {
  switch (options.stage) {
    case TrainingStage::kPose:
      return MakePoseLearner(generator, options);
    case TrainingStage::kRefinement: {
      const auto dir = options.work_dir / "first";
      ModelManifest manifest;
      manifest.name = "first";
      manifest.version = "0";
      manifest.method = kStanceMethod;
      STANCE_RETURN_IF_ERROR(ExportModel(options.work_dir, dir, manifest));
      STANCE_ASSIGN_OR_RETURN(std::unique_ptr<PoseModel> first, PoseModel::Load(dir));
      const TrainingProgress seen{0, first->manifest().samples, first->manifest().max_ring, 0,
                                  first->manifest().features};
      STANCE_RETURN_IF_ERROR(CheckSameSamples(CheckpointPath(options.work_dir, TrainingStage::kPose), seen,
                                              NoProgress(options)));
      return MakePoseLearner(generator, options, std::move(first));
    }
    case TrainingStage::kRigging:
    case TrainingStage::kWhole:
      return MakeNeuralLearner(generator, options);
    case TrainingStage::kTransfer: {
      RiggingBranch rigging;
      STANCE_ASSIGN_OR_RETURN(
          const TrainingProgress seen,
          LoadStage(options.work_dir, TrainingStage::kRigging, {"rigging", rigging.ptr()}, torch::kCPU));
      STANCE_RETURN_IF_ERROR(CheckSameSamples(CheckpointPath(options.work_dir, TrainingStage::kRigging), seen,
                                              NoProgress(options)));
      return MakeNeuralLearner(generator, options, std::move(rigging));
    }
    default:
      return MakeSkeletalLearner(generator, options);
  }
}

// Puts the weights of another run's stage into the modules where names and shapes agree.
absl::Status StartFrom(const std::filesystem::path& checkpoint, const NamedModules& modules,
                       torch::Device device, const std::function<void(const std::string&)>& report) {
  STANCE_ASSIGN_OR_RETURN(const int taken, LoadMatching(checkpoint, modules, device));
  if (taken == 0) {
    return absl::FailedPreconditionError(fmt::format("{}: no matching weights", checkpoint.string()));
  }
  report(fmt::format("starting from {}: {} tensors", checkpoint.string(), taken));
  return absl::OkStatus();
}

absl::Status TrainImpl(const CharacterGenerator& generator, const TrainingOptions& options,
                       const std::function<void(const std::string&)>& report) {
  at::set_num_threads(options.threads);
  torch::manual_seed(options.seed);
  const torch::Device device(options.device);
  std::error_code error;
  std::filesystem::create_directories(options.work_dir, error);
  if (error)
    return absl::PermissionDeniedError(fmt::format("{}: {}", options.work_dir.string(), error.message()));

  STANCE_ASSIGN_OR_RETURN(const std::unique_ptr<Learner> learner, MakeLearner(generator, options));
  const NamedModules modules = learner->modules();
  std::vector<torch::Tensor> parameters;
  for (const auto& [name, module] : modules) {
    module->to(device);
    module->train();
    for (const auto& parameter : module->parameters()) parameters.push_back(parameter);
  }
  AdamW optimizer(parameters, learner->weight_decay());
  const auto checkpoint = CheckpointPath(options.work_dir, options.stage);
  TrainingProgress progress = NoProgress(options);
  if (auto resumed = LoadCheckpoint(checkpoint, modules, &optimizer, device); resumed.ok()) {
    STANCE_RETURN_IF_ERROR(CheckSameSamples(checkpoint, *resumed, progress));
    progress = *resumed;
    report(fmt::format("resuming {} at {} {}", TrainingStageName(options.stage), progress.seen,
                       Unit(options.stage)));
  } else if (resumed.status().code() != absl::StatusCode::kNotFound) {
    return resumed.status();
  } else if (!options.start_from.empty()) {
    STANCE_RETURN_IF_ERROR(
        StartFrom(CheckpointPath(options.start_from, options.stage), modules, device, report));
  } else if (options.stage == TrainingStage::kRefinement) {
    STANCE_RETURN_IF_ERROR(
        StartFrom(CheckpointPath(options.work_dir, TrainingStage::kPose), modules, device, report));
  } else if (options.stage == TrainingStage::kBoth || options.stage == TrainingStage::kWhole) {
    const StagePair& before = options.stage == TrainingStage::kBoth ? kBeforeBoth : kBeforeWhole;
    STANCE_ASSIGN_OR_RETURN(const TrainingProgress stages,
                            LoadStages(options.work_dir, before, modules, device));
    STANCE_RETURN_IF_ERROR(CheckSameSamples(CheckpointPath(options.work_dir, before[1]), stages, progress));
  }

  learner->Start(progress.seen);
  const auto csv = options.work_dir / (TrainingStageName(options.stage) + ".csv");
  const auto begin = SteadyClock::now();
  const double seconds_before = progress.seconds;
  const int64_t seen_before = progress.seen;
  auto last_checkpoint = begin, last_report = begin;
  LogRow sums;
  int64_t steps = 0;
  while (progress.seen < options.total_samples) {
    const double rate = CosineRate(options, progress.seen);
    const TrainingStep step = learner->Next(progress.seen);
    optimizer.ClearGradients();
    step.loss.backward();
    const double gradient = optimizer.Step(rate, kLongestGradient);
    const auto loss = step.loss.item<double>();
    if (!std::isfinite(loss) || !std::isfinite(gradient)) {
      return absl::InternalError(fmt::format(
          "stage '{}' after {} {}: the loss ({}) or its gradient ({}) is not finite; a "
          "smaller learning "
          "rate than {} may help; the last checkpoint is kept",
          TrainingStageName(options.stage), progress.seen, Unit(options.stage), loss, gradient, rate));
    }
    progress.seen += options.batch_size;
    ++steps;
    sums.loss += loss;
    sums.accuracy += step.accuracy;
    sums.joint_mm += step.joint_mm;
    sums.degrees += step.degrees;
    sums.transfer_mm += step.transfer_mm;

    const auto now = SteadyClock::now();
    const double elapsed = Seconds(now - begin).count();
    progress.seconds = seconds_before + elapsed;
    const bool out_of_time = elapsed > options.max_hours * 3600;
    const bool last = out_of_time || progress.seen >= options.total_samples;
    if (last || Seconds(now - last_report).count() > 15) {
      last_report = now;
      const LogRow row{static_cast<double>(progress.seen),
                       progress.seconds,
                       sums.loss / static_cast<double>(steps),
                       sums.accuracy / static_cast<double>(steps),
                       sums.joint_mm / static_cast<double>(steps),
                       sums.degrees / static_cast<double>(steps),
                       sums.transfer_mm / static_cast<double>(steps),
                       rate};
      const double speed = static_cast<double>(progress.seen - seen_before) / elapsed;
      report(
          fmt::format("{} {}/{}  loss {:.5f}  accuracy {:.4f}  joints {:.1f} mm  rotations {:.1f} deg  "
                      "transfer {:.1f} mm  "
                      "lr {:.2e}  "
                      "{:.1f} samples/s  "
                      "ETA {:.0f} min",
                      TrainingStageName(options.stage), progress.seen, options.total_samples, row.loss,
                      row.accuracy, row.joint_mm, row.degrees, row.transfer_mm, rate, speed,
                      static_cast<double>(options.total_samples - progress.seen) / speed / 60));
      STANCE_RETURN_IF_ERROR(AppendLog(csv, row));
      sums = {};
      steps = 0;
    }
    if (last || Seconds(now - last_checkpoint).count() > options.checkpoint_minutes * 60) {
      last_checkpoint = now;
      STANCE_RETURN_IF_ERROR(SaveCheckpoint(checkpoint, modules, &optimizer, progress));
      STANCE_ASSIGN_OR_RETURN(const auto rows, ReadLog(csv));
      auto svg = csv;
      STANCE_RETURN_IF_ERROR(WriteLossPlot(rows, "loss, stage " + TrainingStageName(options.stage),
                                           svg.replace_extension(".svg")));
    }
    if (out_of_time) break;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TrainingStage> TrainingStageFromName(const std::string& name) {
  std::vector<std::string> names;
  for (const auto stage : {TrainingStage::kWeights, TrainingStage::kJoints, TrainingStage::kBoth,
                           TrainingStage::kPose, TrainingStage::kRefinement, TrainingStage::kRigging,
                           TrainingStage::kTransfer, TrainingStage::kWhole}) {
    names.push_back(TrainingStageName(stage));
    if (name == names.back()) return stage;
  }
  return absl::InvalidArgumentError(fmt::format("stage '{}' is none of {}", name, fmt::join(names, ", ")));
}

std::string TrainingStageName(TrainingStage stage) {
  switch (stage) {
    case TrainingStage::kWeights:
      return "weights";
    case TrainingStage::kJoints:
      return "joints";
    case TrainingStage::kBoth:
      return "both";
    case TrainingStage::kPose:
      return "pose";
    case TrainingStage::kRefinement:
      return "refinement";
    case TrainingStage::kRigging:
      return "rigging";
    case TrainingStage::kTransfer:
      return "transfer";
    case TrainingStage::kWhole:
      return "whole";
  }
  return "";
}

std::string TrainingStageMethod(TrainingStage stage) {
  switch (stage) {
    case TrainingStage::kWeights:
    case TrainingStage::kJoints:
    case TrainingStage::kBoth:
      return kSkeletalMethod;
    case TrainingStage::kPose:
    case TrainingStage::kRefinement:
      return kStanceMethod;
    case TrainingStage::kRigging:
    case TrainingStage::kTransfer:
    case TrainingStage::kWhole:
      return kNeuralMethod;
  }
  return "";
}

TrainingOptions DefaultTrainingOptions(TrainingStage stage) {
  TrainingOptions options;
  options.stage = stage;
  if (stage == TrainingStage::kBoth) {
    options.batch_size = 4;
    options.learning_rate = 2e-4;
  } else if (stage == TrainingStage::kPose) {
    options.learning_rate = 2e-3;
  } else if (stage == TrainingStage::kRefinement) {
    options.learning_rate = 6e-4;  // its network starts as a trained one
  } else if (stage == TrainingStage::kRigging) {
    options.learning_rate = 1e-4;
  } else if (stage == TrainingStage::kTransfer) {
    options.learning_rate = 5e-5;
  } else if (stage == TrainingStage::kWhole) {
    options.batch_size = 4;
    options.learning_rate = 5e-5;
  }
  return options;
}

absl::Status Train(const CharacterGenerator& generator, const TrainingOptions& options,
                   const std::function<void(const std::string&)>& report) {
  STANCE_RETURN_IF_ERROR(CheckOptions(options));
  STANCE_RETURN_IF_ERROR(generator.Check({.split = Split::kTrain, .rigged_share = options.rigged_share}));
  try {
    return TrainImpl(generator, options, report);
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("training: {}", error.what()));
  }
}

absl::Status ExportModel(const std::filesystem::path& work_dir, const std::filesystem::path& model_dir,
                         ModelManifest manifest) {
  TensorMap tensors;
  absl::StatusOr<TrainingProgress> progress;
  if (manifest.method == kStanceMethod) {
    PoseNetwork pose;
    const auto path = CheckpointPath(work_dir, TrainingStage::kPose);
    progress = LoadCheckpoint(path, {{"pose", pose.ptr()}}, nullptr, torch::kCPU);
    if (absl::IsNotFound(progress.status())) {
      return absl::FailedPreconditionError(fmt::format("{}: no checkpoint of stage 'pose'", path.string()));
    }
    tensors = ModuleTensors(*pose, kPoseNetworkPrefix, /*half=*/true);
    PoseNetwork refinement;
    const absl::Status refined = LoadCheckpoint(CheckpointPath(work_dir, TrainingStage::kRefinement),
                                                {{"pose", refinement.ptr()}}, nullptr, torch::kCPU)
                                     .status();
    if (refined.ok()) {
      tensors.merge(ModuleTensors(*refinement, kRefinementNetworkPrefix, /*half=*/true));
    } else if (!absl::IsNotFound(refined)) {
      return refined;
    }
  } else if (manifest.method == kNeuralMethod) {
    RiggingBranch rigging;
    TransferBranch transfer;
    const NamedModules both = {{"rigging", rigging.ptr()}, {"transfer", transfer.ptr()}};
    progress = LoadCheckpoint(CheckpointPath(work_dir, TrainingStage::kWhole), both, nullptr, torch::kCPU);
    if (absl::IsNotFound(progress.status())) progress = LoadStages(work_dir, kBeforeWhole, both, torch::kCPU);
    tensors = ModuleTensors(*rigging, kRiggingBranchPrefix, /*half=*/true);
    tensors.merge(ModuleTensors(*transfer, kTransferBranchPrefix, /*half=*/true));
  } else {
    WeightNetwork weights;
    JointNetwork joints;
    const NamedModules both = {{"f_c", weights.ptr()}, {"f_j", joints.ptr()}};
    progress = LoadCheckpoint(CheckpointPath(work_dir, TrainingStage::kBoth), both, nullptr, torch::kCPU);
    if (absl::IsNotFound(progress.status())) progress = LoadStages(work_dir, kBeforeBoth, both, torch::kCPU);
    tensors = ModuleTensors(*weights, kWeightNetworkPrefix, /*half=*/true);
    tensors.merge(ModuleTensors(*joints, kJointNetworkPrefix, /*half=*/true));
  }
  if (!progress.ok()) return progress.status();
  manifest.samples = progress->samples_per_mesh;
  manifest.max_ring = static_cast<int>(progress->max_ring);
  manifest.features = progress->features;
  return WriteModel(model_dir, manifest, tensors);
}

}  // namespace stance
