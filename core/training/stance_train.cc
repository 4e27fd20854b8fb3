// stance-train: builds data packs, trains, and exports models.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/allocator.h"
#include "core/mesh/mesh_io.h"
#include "core/mesh/weld.h"
#include "core/network/neural_model.h"
#include "core/network/pose_model.h"
#include "core/network/product.h"
#include "core/network/skeletal_model.h"
#include "core/training/character_generator.h"
#include "core/training/decimation.h"
#include "core/training/trainer.h"
#include "core/transfer/self_test.h"

namespace {

using stance::CharacterGenerator;

// The index-th test character of a stream, facing +z, as a mesh file.
absl::Status WriteCharacter(const CharacterGenerator& generator, uint64_t seed, int64_t index, int vertices,
                            double rigged_share, const std::string& mix, const std::string& path) {
  stance::CharacterOptions options;
  options.split = stance::Split::kTest;
  options.poses = mix == "hard" ? stance::PoseMix::kHard : stance::PoseMix::kModerate;
  options.vertices = vertices;
  options.global_rotation = false;
  options.rigged_share = rigged_share;
  STANCE_RETURN_IF_ERROR(generator.Check(options));
  return stance::WriteMesh(generator.Make(seed, index, options).mesh, path);
}

absl::Status WritePack(const std::string& mpfb, const std::string& bvh,
                       const std::vector<std::string>& rigged, const std::string& out) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, CharacterGenerator::FromData(mpfb, bvh));
  for (const std::string& folder : rigged) {
    STANCE_ASSIGN_OR_RETURN(const std::vector<std::string> refused, generator->AddRigged(folder));
    for (const std::string& line : refused) fmt::print(stderr, "left out: {}\n", line);
  }
  if (!rigged.empty()) {
    const std::vector<std::string> held_out = generator->RiggedNames(stance::Split::kTest);
    fmt::print("rigged characters: {} for training; held out: {}\n",
               generator->RiggedNames(stance::Split::kTrain).size(), fmt::join(held_out, ", "));
  }
  return generator->WritePack(out);
}

int Finish(const absl::Status& status) {
  if (status.ok()) return 0;
  fmt::print(stderr, "stance-train: {}\n", std::string(status.message()));
  return 1;
}

absl::Status WriteUntrained(const std::string& out, uint64_t seed, const stance::ModelManifest& manifest) {
  if (manifest.method == stance::kStanceMethod) return stance::PoseModel::WriteUntrained(out, seed, manifest);
  if (manifest.method == stance::kNeuralMethod)
    return stance::NeuralModel::WriteUntrained(out, seed, manifest);
  return stance::SkeletalModel::WriteUntrained(out, seed, manifest);
}

// Coarse enough for a file of some 40 KB.
constexpr int kSelfTestVertices = 700;

absl::Status WriteSelfTest(const std::string& model, const std::string& path) {
  STANCE_ASSIGN_OR_RETURN(const stance::TriangleMesh mesh, stance::ReadMesh(path));
  const stance::TriangleMesh welded = stance::WeldVertices(mesh).mesh;
  const auto coarse = stance::BuildLevels(welded.positions, welded.faces, {kSelfTestVertices}).back();
  stance::TriangleMesh sample;
  sample.positions = welded.positions(coarse.vertices, Eigen::all);
  sample.faces = coarse.faces;
  return stance::WriteSelfTest(model, sample);
}

// With a self-test if there is a mesh for it; without, one of former weights would refuse the model.
absl::Status Export(const std::string& work, const std::string& out, const stance::ModelManifest& manifest,
                    const std::string& mesh) {
  std::error_code ignored;
  std::filesystem::remove(std::filesystem::path(out) / stance::kSelfTestFile, ignored);
  STANCE_RETURN_IF_ERROR(stance::ExportModel(work, out, manifest));
  return mesh.empty() ? absl::OkStatus() : WriteSelfTest(out, mesh);
}

// The stage of that name; of the method, too, unless that is empty.
absl::StatusOr<stance::TrainingStage> FindStage(const std::string& name, const std::string& method) {
  STANCE_ASSIGN_OR_RETURN(const stance::TrainingStage stage, stance::TrainingStageFromName(name));
  const std::string own = stance::TrainingStageMethod(stage);
  if (!method.empty() && method != own) {
    return absl::InvalidArgumentError(
        fmt::format("stage '{}' is one of the method '{}', not of '{}'", name, own, method));
  }
  return stage;
}

void Report(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  stance::KeepFreedMemory();
  CLI::App app("Trains Stance's networks on MakeHuman's CC0 body and CMU motion capture.");
  app.require_subcommand(1);

  std::string mpfb, bvh, out;
  std::vector<std::string> rigged;
  auto* pack = app.add_subcommand("pack", "Write the generator's data as one file");
  pack->add_option("--mpfb", mpfb, "Folder with MPFB's 3dobjs, targets and rigs")->required();
  pack->add_option("--bvh", bvh, "Folder with BVH clips")->required();
  pack->add_option("--rigged", rigged, "Folder with rigged characters (.fbx, .glb); may be repeated");
  pack->add_option("-o,--out", out, "The pack to write")->required();

  uint64_t seed = 1;
  stance::ModelManifest manifest;
  manifest.name = "untrained";
  manifest.version = "0";
  auto* init = app.add_subcommand("init", "Write an untrained model, for tests");
  init->add_option("-o,--out", out, "The model directory to write")->required();
  init->add_option("--seed", seed, "Seed of the random weights")->capture_default_str();
  init->add_option("--method", manifest.method, "The method whose networks to write")
      ->check(CLI::IsMember({stance::kSkeletalMethod, stance::kStanceMethod, stance::kNeuralMethod}))
      ->capture_default_str();
  init->add_option("--name", manifest.name, "The model's name")->capture_default_str();
  init->add_option("--samples", manifest.samples, "Surface samples per mesh")->capture_default_str();

  stance::TrainingOptions options;
  int64_t index = 0;
  int vertices = 0;
  std::string data, mix = "moderate";
  auto* character = app.add_subcommand("character", "Write one of the generator's test characters as a mesh");
  character->add_option("--data", data, "Pack written by 'stance-train pack'")->required();
  character->add_option("--seed", seed, "Seed of the stream")->capture_default_str();
  character->add_option("--index", index, "Which one")->capture_default_str();
  character->add_option("--vertices", vertices, "About so many vertices; 0: all 13,380")
      ->capture_default_str();
  character
      ->add_option("--rigged-share", options.rigged_share, "1: only the pack's held-out rigged characters")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  character->add_option("--poses", mix, "moderate or hard")
      ->check(CLI::IsMember({"moderate", "hard"}))
      ->capture_default_str();
  character->add_option("-o,--out", out, "Mesh file; the extension gives the format")->required();

  std::optional<int64_t> batch;
  std::optional<double> learning_rate;
  std::optional<bool> bfloat16;
  std::string method, stage = "weights";
  auto* run = app.add_subcommand("run", "Run one training stage, or continue it");
  run->add_option("--data", data, "Pack written by 'stance-train pack'")->required();
  run->add_option("--method", method, "The method that --stage must be one of; no two share a stage's name")
      ->check(CLI::IsMember({stance::kSkeletalMethod, stance::kStanceMethod, stance::kNeuralMethod}));
  run->add_option(
         "--stage", stage,
         "skeletal: weights (f_C), joints (f_J with true weights), both; stance: pose, refinement (its "
         "second look); neural: rigging, transfer, whole")
      ->capture_default_str();
  run->add_option("--work", options.work_dir, "Folder for checkpoints, log and plot")->required();
  run->add_option("--start-from", options.start_from,
                  "Folder of another run whose weights of the stage are the first ones");
  run->add_option("--seed", options.seed, "Seed of weights and samples")->capture_default_str();
  run->add_option("--points", options.samples_per_mesh, "Surface samples per mesh")->capture_default_str();
  run->add_flag("--normals,!--no-normals", options.features.normals,
                "Show stages pose and refinement the samples' normals")
      ->capture_default_str();
  run->add_flag("--geodesic,!--euclidean", options.features.geodesic,
                "Neighbourhoods along the surface in those stages; otherwise in space")
      ->capture_default_str();
  run->add_option("--batch", batch, "Characters per step, of neural's stages pairs [8; both and whole: 4]");
  run->add_option("--samples", options.total_samples, "Characters, or pairs, seen in all")
      ->capture_default_str();
  run->add_option(
      "--lr", learning_rate,
      "Adam's learning rate at the start [1e-3; both: 2e-4; pose: 2e-3; refinement: 6e-4; rigging: "
      "1e-4; transfer and whole: 5e-5]");
  run->add_option("--final-lr", options.final_rate, "Fraction of it at the end of the cosine")
      ->capture_default_str();
  run->add_option("--loss-points", options.loss_points, "Points per mesh in f_C's loss")
      ->capture_default_str();
  run->add_option("--reuse", options.reuse,
                  "How often each character, or pair, comes in the stages of stance and neural, changed anew")
      ->capture_default_str();
  run->add_option("--rigged-share", options.rigged_share, "Share of the pack's rigged characters")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  run->add_flag(
      "--bf16,!--no-bf16", bfloat16,
      "Products in bfloat16 in the stages of stance and neural [where the CPU has AMX, and on CUDA]");
  run->add_option("--threads", options.threads, "Threads of the networks")->capture_default_str();
  run->add_option("--generator-threads", options.generator_threads, "Threads that make samples")
      ->capture_default_str();
  run->add_option("--device", options.device, "cpu or cuda")->capture_default_str();
  run->add_option("--max-hours", options.max_hours, "Stop, resumable, after this many hours");

  std::string work;
  stance::ModelManifest exported;
  exported.version = "1";
  auto* save = app.add_subcommand("export", "Write the newest checkpoints as a model");
  save->add_option("--work", work, "Folder of the training run")->required();
  save->add_option("-o,--out", out, "The model directory to write")->required();
  save->add_option("--method", exported.method, "The method whose networks to write")
      ->check(CLI::IsMember({stance::kSkeletalMethod, stance::kStanceMethod, stance::kNeuralMethod}))
      ->capture_default_str();
  save->add_option("--name", exported.name, "The model's name [the method's with -human24]");
  save->add_option("--model-version", exported.version, "The model's version")->capture_default_str();

  std::string model, mesh;
  save->add_option("--self-test", mesh, "A character's mesh file to make a self-test of");
  auto* self_test = app.add_subcommand("self-test", "Store a sample and the model's answer with the model");
  self_test->add_option("--model", model, "The model's own folder")->required();
  self_test->add_option("--mesh", mesh, "A character's mesh file; a coarse copy is stored")->required();

  CLI11_PARSE(app, argc, argv);

  if (*pack) {
    return Finish(WritePack(mpfb, bvh, rigged, out));
  }
  if (*init) {
    return Finish(WriteUntrained(out, seed, manifest));
  }
  if (exported.name.empty()) exported.name = exported.method + "-human24";
  if (*self_test) return Finish(WriteSelfTest(model, mesh));
  if (*save) return Finish(Export(work, out, exported, mesh));
  if (*character) {
    auto generator = CharacterGenerator::FromPack(data);
    return Finish(generator.ok()
                      ? WriteCharacter(**generator, seed, index, vertices, options.rigged_share, mix, out)
                      : generator.status());
  }
  auto parsed = FindStage(stage, method);
  if (!parsed.ok()) return Finish(parsed.status());
  const stance::TrainingOptions defaults = stance::DefaultTrainingOptions(*parsed);
  options.stage = *parsed;
  options.batch_size = batch.value_or(defaults.batch_size);
  options.learning_rate = learning_rate.value_or(defaults.learning_rate);
  options.bfloat16 = bfloat16.value_or(options.device != "cpu" || stance::CpuMultipliesBfloat16());
  auto generator = CharacterGenerator::FromPack(data);
  if (!generator.ok()) return Finish(generator.status());
  return Finish(stance::Train(**generator, options, Report));
}
