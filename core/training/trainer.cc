#include "core/training/trainer.h"

#include <ATen/CPUGeneratorImpl.h>
#include <ATen/Parallel.h>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "core/network/model_files.h"
#include "core/network/skeletal_networks.h"
#include "core/training/checkpoint.h"
#include "core/training/sample_stream.h"
#include "core/training/training_log.h"

namespace stance {
namespace {

using Seconds = std::chrono::duration<double>;
using SteadyClock = std::chrono::steady_clock;
using Modules = std::vector<std::pair<std::string, std::shared_ptr<torch::nn::Module>>>;

std::filesystem::path CheckpointPath(const std::filesystem::path& dir, TrainingStage stage) {
  return dir / (TrainingStageName(stage) + ".ckpt");
}

double CosineRate(const TrainingOptions& options, int64_t seen) {
  const double done = std::min(1.0, static_cast<double>(seen) / static_cast<double>(options.total_samples));
  const double cosine = 0.5 * (1 + std::cos(std::numbers::pi * done));
  return options.learning_rate * (options.final_rate + (1 - options.final_rate) * cosine);
}

// `count` rows of each mesh, the same positions in every mesh: samples are in farthest-point order, which
// says nothing of where on the body they lie, so a random subset of positions is a random subset of the
// surface.
// Drawn from `seed` alone, so that a resumed run repeats what an unbroken one would have done.
torch::Tensor RandomRows(const std::vector<int64_t>& offsets, int64_t count, uint64_t seed) {
  auto generator = at::detail::createCPUGenerator(seed);
  std::vector<torch::Tensor> rows;
  for (size_t mesh = 0; mesh + 1 < offsets.size(); ++mesh) {
    const int64_t size = offsets[mesh + 1] - offsets[mesh];
    rows.push_back(torch::randperm(size, generator, torch::kInt64).slice(0, 0, std::min(count, size)) +
                   offsets[mesh]);
  }
  return torch::cat(rows);
}

struct Step {
  torch::Tensor loss;
  double accuracy = 0;
  double joint_mm = 0;
};

class Stage {
 public:
  Stage(TrainingStage stage, const TrainingOptions& options) : stage_(stage), options_(options) {}

  Modules modules() const {
    Modules modules;
    if (stage_ != TrainingStage::kJoints) modules.emplace_back("f_c", weights_.ptr());
    if (stage_ != TrainingStage::kWeights) modules.emplace_back("f_j", joints_.ptr());
    return modules;
  }

  Step Forward(const TrainingBatch& batch, int64_t seen) {
    Step step;
    torch::Tensor rigid;
    if (stage_ != TrainingStage::kJoints) {
      // f_J needs a label for every point, f_C's loss only for some.
      torch::Tensor logits, target;
      if (stage_ == TrainingStage::kBoth) {
        logits = weights_(batch.input);
        target = batch.joint_of;
        rigid = RigidWeights(logits.detach());
      } else {
        const auto rows =
            RandomRows(batch.input.offsets, options_.loss_points, options_.seed + static_cast<uint64_t>(seen))
                .to(batch.joint_of.device());
        logits = weights_->ForwardRows(batch.input, rows);
        target = batch.joint_of.index_select(0, rows);
      }
      step.loss = torch::nn::functional::cross_entropy(logits, target);  // equation 5
      step.accuracy = (logits.argmax(1) == target).to(torch::kFloat32).mean().item<double>();
    }
    if (stage_ != TrainingStage::kWeights) {
      if (!rigid.defined()) rigid = torch::one_hot(batch.joint_of, kHumanJoints).to(torch::kFloat32);
      const auto difference = joints_(batch.input, rigid) - batch.joints;
      const auto loss = difference.square().sum(2).mean();  // equation 6, per joint
      step.joint_mm = difference.norm(2, 2).mean().item<double>() * kMillimetresPerUnit;
      // In "both" the weights keep most of the gradient's size: joints are 100 times smaller numbers.
      step.loss = step.loss.defined() ? step.loss + 100 * loss : loss;
    }
    return step;
  }

 private:
  // A 1.7 m character standing with its arms down has a bounding-box diagonal of about 1.8 m.
  static constexpr double kMillimetresPerUnit = 1800;

  TrainingStage stage_;
  const TrainingOptions& options_;
  WeightNetwork weights_;
  JointNetwork joints_;
};

absl::Status StartFromStages(const std::filesystem::path& dir, const Modules& modules) {
  for (const auto& [stage, name] :
       {std::pair{TrainingStage::kWeights, "f_c"}, std::pair{TrainingStage::kJoints, "f_j"}}) {
    for (const auto& [module_name, module] : modules) {
      if (module_name != name) continue;
      const auto loaded = LoadCheckpoint(CheckpointPath(dir, stage), {{module_name, module}}, nullptr);
      if (!loaded.ok()) {
        return absl::FailedPreconditionError(fmt::format("stage 'both' starts from stage '{}': {}",
                                                         TrainingStageName(stage),
                                                         std::string(loaded.status().message())));
      }
    }
  }
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

  Stage stage(options.stage, options);
  const Modules modules = stage.modules();
  std::vector<torch::Tensor> parameters;
  for (const auto& [name, module] : modules) {
    module->to(device);
    module->train();
    for (const auto& parameter : module->parameters()) parameters.push_back(parameter);
  }
  torch::optim::Adam optimizer(parameters, torch::optim::AdamOptions(options.learning_rate));
  const auto checkpoint = CheckpointPath(options.work_dir, options.stage);
  TrainingProgress progress{0, options.samples_per_mesh, options.max_ring, 0};
  if (auto resumed = LoadCheckpoint(checkpoint, modules, &optimizer); resumed.ok()) {
    if (resumed->samples_per_mesh != options.samples_per_mesh) {
      return absl::FailedPreconditionError(fmt::format("{} was trained on {} samples per mesh, not {}",
                                                       checkpoint.string(), resumed->samples_per_mesh,
                                                       options.samples_per_mesh));
    }
    progress = *resumed;
    report(fmt::format("resuming {} at {} characters", TrainingStageName(options.stage), progress.seen));
  } else if (resumed.status().code() != absl::StatusCode::kNotFound) {
    return resumed.status();
  } else if (options.stage == TrainingStage::kBoth) {
    STANCE_RETURN_IF_ERROR(StartFromStages(options.work_dir, modules));
  }

  // Each stage sees its own characters.
  SampleOptions samples{options.seed * 3 + static_cast<uint64_t>(options.stage), options.samples_per_mesh,
                        options.max_ring};
  SampleStream stream(generator, samples, progress.seen, options.batch_size, options.generator_threads);
  const auto csv = options.work_dir / (TrainingStageName(options.stage) + ".csv");
  const auto begin = SteadyClock::now();
  const double seconds_before = progress.seconds;
  const int64_t seen_before = progress.seen;
  auto last_checkpoint = begin, last_report = begin;
  LogRow sums;
  int64_t steps = 0;
  while (progress.seen < options.total_samples) {
    const double rate = CosineRate(options, progress.seen);
    for (auto& group : optimizer.param_groups()) {
      static_cast<torch::optim::AdamOptions&>(group.options()).lr(rate);
    }
    const TrainingBatch batch = stream.Next().To(device);
    const Step step = stage.Forward(batch, progress.seen);
    optimizer.zero_grad();
    step.loss.backward();
    torch::nn::utils::clip_grad_norm_(parameters, 2.0);
    optimizer.step();
    progress.seen += options.batch_size;
    ++steps;
    sums.loss += step.loss.item<double>();
    sums.accuracy += step.accuracy;
    sums.joint_mm += step.joint_mm;

    const auto now = SteadyClock::now();
    const double elapsed = Seconds(now - begin).count();
    progress.seconds = seconds_before + elapsed;
    const bool out_of_time = elapsed > options.max_hours * 3600;
    const bool last = out_of_time || progress.seen >= options.total_samples;
    if (last || Seconds(now - last_report).count() > 15) {
      last_report = now;
      const LogRow row{static_cast<double>(progress.seen),         progress.seconds,
                       sums.loss / static_cast<double>(steps),     sums.accuracy / static_cast<double>(steps),
                       sums.joint_mm / static_cast<double>(steps), rate};
      const double speed = static_cast<double>(progress.seen - seen_before) / elapsed;
      report(fmt::format(
          "{} {}/{}  loss {:.5f}  accuracy {:.4f}  joints {:.1f} mm  lr {:.2e}  {:.1f} samples/s  "
          "ETA {:.0f} min",
          TrainingStageName(options.stage), progress.seen, options.total_samples, row.loss, row.accuracy,
          row.joint_mm, rate, speed,
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
  for (const auto stage : {TrainingStage::kWeights, TrainingStage::kJoints, TrainingStage::kBoth}) {
    if (name == TrainingStageName(stage)) return stage;
  }
  return absl::InvalidArgumentError(fmt::format("stage '{}' is none of weights, joints, both", name));
}

std::string TrainingStageName(TrainingStage stage) {
  switch (stage) {
    case TrainingStage::kWeights:
      return "weights";
    case TrainingStage::kJoints:
      return "joints";
    case TrainingStage::kBoth:
      return "both";
  }
  return "";
}

absl::Status Train(const CharacterGenerator& generator, const TrainingOptions& options,
                   const std::function<void(const std::string&)>& report) {
  if (options.batch_size < 1 || options.total_samples < 1 || options.samples_per_mesh < 64) {
    return absl::InvalidArgumentError(fmt::format("batch size {}, total samples {}, samples per mesh {}",
                                                  options.batch_size, options.total_samples,
                                                  options.samples_per_mesh));
  }
  try {
    return TrainImpl(generator, options, report);
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("training: {}", error.what()));
  }
}

absl::Status ExportModel(const std::filesystem::path& work_dir, const std::filesystem::path& model_dir,
                         const std::string& name, const std::string& version) {
  WeightNetwork weights;
  JointNetwork joints;
  const Modules both = {{"f_c", weights.ptr()}, {"f_j", joints.ptr()}};
  auto progress = LoadCheckpoint(CheckpointPath(work_dir, TrainingStage::kBoth), both, nullptr);
  if (absl::IsNotFound(progress.status())) {
    STANCE_RETURN_IF_ERROR(StartFromStages(work_dir, both));
    progress = LoadCheckpoint(CheckpointPath(work_dir, TrainingStage::kWeights), {both[0]}, nullptr);
  }
  if (!progress.ok()) return progress.status();
  TensorMap tensors = ModuleTensors(*weights, kWeightNetworkPrefix, /*half=*/true);
  tensors.merge(ModuleTensors(*joints, kJointNetworkPrefix, /*half=*/true));
  ModelManifest manifest;
  manifest.name = name;
  manifest.version = version;
  manifest.samples = progress->samples_per_mesh;
  manifest.max_ring = static_cast<int>(progress->max_ring);
  return WriteModel(model_dir, manifest, tensors);
}

}  // namespace stance
