// Trains paper A's networks in its three stages (section 3.1.4): f_C, f_J with true weights, then both; the
// networks of METHOD_STANCE in two; and paper B's branches in its three (section 4).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/base/status.h"
#include "core/network/model_manifest.h"
#include "core/training/character_generator.h"

namespace stance {

enum class TrainingStage {
  kWeights,     // f_C
  kJoints,      // f_J with true weights
  kBoth,        // f_J on f_C's own output
  kPose,        // the network of METHOD_STANCE
  kRefinement,  // the network that looks at what kPose's has unposed
  kRigging,     // the rigging branch of METHOD_NEURAL, on pairs as the next two
  kTransfer,    // its transfer branch, on what the rigging branch, which stays as it is, finds
  kWhole,       // both branches
};

absl::StatusOr<TrainingStage> TrainingStageFromName(
    const std::string& name);                        // as TrainingStageName gives them
std::string TrainingStageName(TrainingStage stage);  // "weights", "joints", ..., "whole"
// The method whose model the stage trains a part of: kSkeletalMethod, ...
std::string TrainingStageMethod(TrainingStage stage);

struct TrainingOptions {
  TrainingStage stage = TrainingStage::kWeights;
  // Where checkpoints, the CSV log and the loss plot go; a stage continues from its own checkpoint there,
  // "both" starts from the other two's, "refinement" from that of "pose", whose network it refines,
  // "transfer" goes on from what "rigging" has left, and "whole" starts from both.
  std::filesystem::path work_dir;
  // A folder whose checkpoint of the stage gives the first weights, where work_dir has none; of networks that
  // differ, those that have the same names and shapes. Empty: random ones.
  std::filesystem::path start_from{};
  uint64_t seed = 1;
  int64_t samples_per_mesh = 1024;
  int max_ring = 12;
  InputFeatures features{};        // of stages "pose" and "refinement"; part of the model
  int64_t batch_size = 8;          // paper A: 8, and 4 for "both"; of METHOD_NEURAL, pairs
  int64_t total_samples = 50'000;  // characters, or pairs, seen by the end of the cosine
  double learning_rate = 1e-3;  // paper A: 1e-4 over 500,000 samples, then 5e-5 for "both"; 1e-3 reaches as
                                // far in fewer
  double final_rate = 0.02;     // fraction of learning_rate at the end of the cosine
  // Points per mesh on which f_C's head and loss are evaluated: neighbours say nearly the same.
  int64_t loss_points = 256;
  // How often each character, or pair, comes in the stages of METHOD_STANCE and METHOD_NEURAL, turned or
  // unposed, and mirrored, anew (pose_samples.h, neural_samples.h).
  int64_t reuse = 1;
  // CharacterOptions::rigged_share of the characters seen.
  double rigged_share = 0;
  // Matrix products with bfloat16 operands in those stages (product.h).
  bool bfloat16 = false;
  int threads = 1;             // for the networks
  int generator_threads = 1;   // for the samples
  std::string device = "cpu";  // or "cuda"
  double checkpoint_minutes = 3;
  double max_hours = 1e9;  // stops after a checkpoint, resumable, when this much has passed
};

// The options of a stage where nobody says otherwise: "both", which tunes what the other two have learned,
// goes with smaller steps (batch 4, learning rate 2e-4). Those of METHOD_NEURAL have paper B's: 16 characters
// (8 pairs) a step at 1e-4, 8 pairs at 5e-5, and 4 pairs at 5e-5.
TrainingOptions DefaultTrainingOptions(TrainingStage stage);

// Runs the stage to its end (or max_hours). `report` receives the progress lines. INVALID_ARGUMENT with name
// and value for an option out of range; FAILED_PRECONDITION when "both", "refinement", "transfer" or "whole"
// finds no checkpoints of the stages before it, or a checkpoint is of another number of samples per mesh or
// neighbours, or of other features; INTERNAL if Torch fails, with its words, and if loss or gradient are no
// longer finite: the last checkpoint then stays as it is.
absl::Status Train(const CharacterGenerator& generator, const TrainingOptions& options,
                   const std::function<void(const std::string&)>& report);

// Writes the networks of the newest checkpoints (of kSkeletalMethod those of stage "both", else of the other
// two; of kNeuralMethod those of "whole", else of the other two; of kStanceMethod those of stage "pose"
// and, where there is one, "refinement") as a model directory: manifest.name, version and method say
// which, the rest of the manifest is filled in. FAILED_PRECONDITION if there are none, or if the two were
// trained on different samples.
absl::Status ExportModel(const std::filesystem::path& work_dir, const std::filesystem::path& model_dir,
                         ModelManifest manifest);

}  // namespace stance
