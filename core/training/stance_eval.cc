// stance-eval: measures methods and models on transfers with known answers, and renders them.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <numbers>

#include "core/base/files.h"
#include "core/base/threads.h"
#include "core/mesh/mesh_io.h"
#include "core/training/evaluation_files.h"
#include "core/training/evaluation_pairs.h"
#include "core/training/evaluation_pictures.h"
#include "core/training/evaluation_stages.h"

namespace stance {
namespace {

struct Arguments {
  std::string command_line;
  std::filesystem::path model, data, mpfb, bvh, out, list;
  std::string method = "skeletal", poses = "both", twist = "paper", smoothing = "metric";
  std::string source_up = "y", reference_up = "y";
  std::vector<std::filesystem::path> files;
  std::vector<int> indices;
  int pairs = 100, every = 1, identities = 10, poses_each = 20, threads = CpuQuota();
  uint64_t seed = 1;
  double yaw_degrees = 20;
  bool full_resolution = false, no_parts = false, skeletons = false, weights = false;
  CharacterOptions characters{.split = Split::kTest};
  TransferOptions transfer;
};

absl::StatusOr<std::unique_ptr<CharacterGenerator>> OpenGenerator(const Arguments& arguments) {
  if (!arguments.data.empty()) return CharacterGenerator::FromPack(arguments.data);
  if (!arguments.mpfb.empty() && !arguments.bvh.empty()) {
    return CharacterGenerator::FromData(arguments.mpfb, arguments.bvh);
  }
  return absl::InvalidArgumentError("the characters are missing: give --data, or --mpfb and --bvh");
}

absl::StatusOr<std::unique_ptr<Pipeline>> OpenPipeline(const Arguments& arguments) {
  return Pipeline::Load(arguments.model, {.threads = 1, .full_resolution = arguments.full_resolution});
}

absl::Status MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(fmt::format("{}: {}", folder.string(), error.message()));
}

std::vector<PoseMix> PoseMixes(const std::string& name) {
  if (name == "moderate") return {PoseMix::kModerate};
  if (name == "hard") return {PoseMix::kHard};
  return {PoseMix::kModerate, PoseMix::kHard};
}

// What a table's reader must know of how it came to be.
std::string Heading(const Arguments& arguments, const Pipeline& pipeline, const std::string& title) {
  const ModelInfo& model = pipeline.models().front();
  return fmt::format(
      "# {}\n\nModel {} version {}, {} parameters, {}. Made by\n\n    {}\n\n", title, model.name,
      model.version, model.parameter_count,
      arguments.full_resolution ? "every vertex" : fmt::format("{} samples", model.sample_count),
      arguments.command_line);
}

// Prints the markdown and writes it and the CSV as <out>/<name>.md and .csv.
absl::Status WriteTables(const Arguments& arguments, const std::string& name, const std::string& markdown,
                         const std::string& csv) {
  fmt::print("{}", markdown);
  if (arguments.out.empty()) return absl::OkStatus();
  STANCE_RETURN_IF_ERROR(MakeFolder(arguments.out));
  STANCE_RETURN_IF_ERROR(WriteFile(arguments.out / (name + ".md"), markdown));
  return WriteFile(arguments.out / (name + ".csv"), csv);
}

// Prints "17 / 100" to standard error at every twentieth of the way.
std::function<void(int)> Progress(int total) {
  return [total](int done) {
    const int step = std::max(1, total / 20);
    if (done % step == 0 || done == total) fmt::print(stderr, "{} / {}\n", done, total);
  };
}

absl::Status EvaluatePairs(const Arguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  const std::vector<PoseMix> mixes = PoseMixes(arguments.poses);
  std::vector<EvaluationRow> all;
  std::string markdown = Heading(arguments, *pipeline, "Transfer of test pairs");
  markdown +=
      "Identities and poses that training never saw; the source's stature scaled to 1.7 m; nothing "
      "centred.\n";
  for (const PoseMix mix : mixes) {
    const PairEvaluationOptions options{.seed = arguments.seed,
                                        .pairs = arguments.pairs,
                                        .poses = {mix},
                                        .characters = arguments.characters,
                                        .transfer = arguments.transfer,
                                        .parts = !arguments.no_parts,
                                        .threads = arguments.threads};
    const std::vector<EvaluationRow> rows =
        stance::EvaluatePairs(*generator, *pipeline, options, Progress(arguments.pairs));
    markdown += fmt::format("\n## {} poses\n\n{}", PoseMixName(mix), SummaryMarkdown(rows));
    all.insert(all.end(), rows.begin(), rows.end());
  }
  return WriteTables(arguments, "pairs", markdown, RowsCsv(all));
}

absl::Status EvaluateStages(const Arguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  std::string markdown = Heading(arguments, *pipeline, "The rigger's stages on test characters");
  std::string csv;
  for (const PoseMix mix : PoseMixes(arguments.poses)) {
    StageEvaluationOptions options{.seed = arguments.seed,
                                   .characters = arguments.pairs,
                                   .identities = arguments.identities,
                                   .poses_each = arguments.poses_each,
                                   .character = arguments.characters,
                                   .transfer = arguments.transfer,
                                   .threads = arguments.threads};
    options.character.poses = mix;
    const StageErrors errors =
        stance::EvaluateStages(*generator, *pipeline, options, Progress(arguments.pairs));
    markdown +=
        fmt::format("## {} poses\n\n{}\n", PoseMixName(mix), StagesMarkdown(errors, pipeline->skeleton()));
    csv += StagesCsv(errors, pipeline->skeleton(), PoseMixName(mix));
  }
  return WriteTables(arguments, "stages", markdown, "poses,quantity,value\n" + csv);
}

absl::Status EvaluateFileList(const Arguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(arguments.list));
  const auto cases = ParseFileList(text, arguments.list.parent_path());
  if (!cases.ok()) {
    return absl::InvalidArgumentError(
        fmt::format("{}: {}", arguments.list.string(), std::string(cases.status().message())));
  }
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  STANCE_ASSIGN_OR_RETURN(const std::vector<EvaluationRow> rows,
                          EvaluateFiles(*cases, *pipeline, arguments.transfer, arguments.threads));
  return WriteTables(arguments, "files",
                     Heading(arguments, *pipeline, "Transfer of meshes from files") + SummaryMarkdown(rows),
                     RowsCsv(rows));
}

PictureOptions Pictures(const Arguments& arguments) {
  PictureOptions options{.skeletons = arguments.skeletons,
                         .weights = arguments.weights,
                         .source_up = arguments.transfer.source_up,
                         .reference_up = arguments.transfer.reference_up};
  options.render.yaw = arguments.yaw_degrees * std::numbers::pi / 180;
  return options;
}

absl::Status WritePicture(const Arguments& arguments, const std::string& name, const Image& image) {
  const std::filesystem::path path = arguments.out / (name + ".png");
  STANCE_RETURN_IF_ERROR(WritePng(image, path));
  fmt::print("{}\n", path.string());
  return absl::OkStatus();
}

absl::Status RenderFiles(const Arguments& arguments, const Pipeline& pipeline) {
  for (size_t i = 0; i + 1 < arguments.files.size(); i += 2) {
    STANCE_ASSIGN_OR_RETURN(const TriangleMesh source, ReadMesh(arguments.files[i]));
    STANCE_ASSIGN_OR_RETURN(const TriangleMesh reference, ReadMesh(arguments.files[i + 1]));
    STANCE_ASSIGN_OR_RETURN(const TransferResult result,
                            pipeline.Transfer(source, reference, arguments.transfer));
    const Image image =
        RenderTransfer(source, reference, result, nullptr, kReferenceStature, Pictures(arguments));
    const std::string name =
        arguments.files[i].stem().string() + "_as_" + arguments.files[i + 1].stem().string();
    STANCE_RETURN_IF_ERROR(WritePicture(arguments, name, image));
  }
  return absl::OkStatus();
}

absl::Status RenderPairs(const Arguments& arguments, const Pipeline& pipeline) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  std::vector<int> indices = arguments.indices;
  for (int i = 0; arguments.indices.empty() && i < arguments.pairs; i += arguments.every)
    indices.push_back(i);
  for (const PoseMix mix : PoseMixes(arguments.poses)) {
    CharacterOptions characters = arguments.characters;
    characters.poses = mix;
    for (const int index : indices) {
      const TransferPair pair = generator->MakePair(arguments.seed, index, characters);
      STANCE_ASSIGN_OR_RETURN(const TransferResult result,
                              pipeline.Transfer(pair.source.mesh, pair.reference.mesh, arguments.transfer));
      const Image image = RenderTransfer(pair.source.mesh, pair.reference.mesh, result, &pair.truth,
                                         pair.source.stature, Pictures(arguments));
      STANCE_RETURN_IF_ERROR(WritePicture(arguments, fmt::format("{}-{}", PoseMixName(mix), index), image));
    }
  }
  return absl::OkStatus();
}

absl::Status Render(const Arguments& arguments) {
  if (arguments.files.size() % 2 != 0) {
    return absl::InvalidArgumentError("--files: each source needs a reference after it");
  }
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  STANCE_RETURN_IF_ERROR(MakeFolder(arguments.out));
  return arguments.files.empty() ? RenderPairs(arguments, *pipeline) : RenderFiles(arguments, *pipeline);
}

UpAxis UpAxisFromName(const std::string& name) {
  if (name == "z") return UpAxis::kZ;
  return name == "x" ? UpAxis::kX : UpAxis::kY;
}

absl::Status Interpret(Arguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(arguments.transfer.method, MethodFromName(arguments.method));
  arguments.transfer.twist = arguments.twist == "inherited" ? Twist::kInherited : Twist::kPaper;
  if (arguments.smoothing == "hopwise") arguments.transfer.smoothing.kind = SmoothingKind::kHopwise;
  if (arguments.smoothing == "none") arguments.transfer.smoothing.kind = SmoothingKind::kNone;
  arguments.transfer.source_up = UpAxisFromName(arguments.source_up);
  arguments.transfer.reference_up = UpAxisFromName(arguments.reference_up);
  return absl::OkStatus();
}

void AddModelOptions(CLI::App& command, Arguments& arguments) {
  TransferOptions& transfer = arguments.transfer;
  command.add_option("--model", arguments.model, "The model's folder")->required();
  command.add_option("--method", arguments.method, "The method")->capture_default_str();
  command.add_option("--twist", arguments.twist, "Rotation about a bone's own axis")
      ->check(CLI::IsMember({"paper", "inherited"}))
      ->capture_default_str();
  command.add_option("--smoothing", arguments.smoothing, "How weights are smoothed")
      ->check(CLI::IsMember({"metric", "hopwise", "none"}))
      ->capture_default_str();
  command.add_option("--length", transfer.smoothing.length, "Metric smoothing's length, in statures")
      ->capture_default_str();
  command.add_option("--lambda", transfer.smoothing.lambda, "Hopwise smoothing's lambda")
      ->capture_default_str();
  command.add_option("--influences", transfer.max_influences, "Most weights per vertex; 0: all")
      ->capture_default_str();
  command.add_flag("--full-resolution", arguments.full_resolution, "Let the networks see every vertex");
  command.add_option("--threads", arguments.threads, "Transfers at a time")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
}

void AddUpAxisOptions(CLI::App& command, Arguments& arguments) {
  for (auto& [name, value] : {std::pair{"--source-up", &arguments.source_up},
                              std::pair{"--reference-up", &arguments.reference_up}}) {
    command.add_option(name, *value, "The axis that points up")
        ->check(CLI::IsMember({"x", "y", "z"}))
        ->capture_default_str();
  }
}

void AddCharacterOptions(CLI::App& command, Arguments& arguments) {
  command.add_option("--data", arguments.data, "Pack written by 'stance-train pack'");
  command.add_option("--mpfb", arguments.mpfb, "In place of a pack: folder with MPFB's data");
  command.add_option("--bvh", arguments.bvh, "In place of a pack: folder with BVH clips");
  command.add_option("--pairs", arguments.pairs, "Pairs (or characters) of each pose mix")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command.add_option("--seed", arguments.seed, "Seed of the test characters")->capture_default_str();
  command.add_option("--poses", arguments.poses, "Pose mix")
      ->check(CLI::IsMember({"moderate", "hard", "both"}))
      ->capture_default_str();
  command.add_option("--vertices", arguments.characters.vertices, "About so many vertices; 0: the full body")
      ->capture_default_str();
  command.add_option("--noise", arguments.characters.noise, "Noise along normals, metres")
      ->capture_default_str();
  command.add_flag("!--no-global-rotation", arguments.characters.global_rotation,
                   "Characters keep facing +z");
}

}  // namespace

int Main(int argc, char** argv) {
  Arguments arguments;
  for (int i = 0; i < argc; ++i) {
    arguments.command_line +=
        i == 0 ? std::filesystem::path(argv[0]).filename().string() : fmt::format(" {}", argv[i]);
  }
  CLI::App app("Measures pose transfer on pairs with known answers.", "stance-eval");
  app.require_subcommand(1);

  CLI::App* pairs = app.add_subcommand("pairs", "Errors of transfers between generated test characters");
  CLI::App* stages =
      app.add_subcommand("stages", "Errors of weights and joints on generated test characters");
  CLI::App* files = app.add_subcommand("files", "Errors of transfers between meshes in files");
  CLI::App* render = app.add_subcommand("render", "Pictures of transfers");
  for (CLI::App* command : {pairs, stages, files, render}) AddModelOptions(*command, arguments);
  for (CLI::App* command : {pairs, stages, render}) AddCharacterOptions(*command, arguments);
  for (CLI::App* command : {files, render}) AddUpAxisOptions(*command, arguments);
  for (CLI::App* command : {pairs, stages, files}) {
    command->add_option("-o,--out", arguments.out, "Folder for the tables as markdown and CSV");
  }
  pairs->add_flag("--no-parts", arguments.no_parts, "Leave out the compositions with parts of the truth");
  stages->add_option("--identities", arguments.identities, "Identities for the bone lengths")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str();
  stages->add_option("--poses-each", arguments.poses_each, "Poses of each such identity")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  files->add_option("list", arguments.list, "Text file: source reference truth [stature] per line")
      ->required();
  render->add_option("-o,--out", arguments.out, "Folder for the pictures")->required();
  render->add_option("--files", arguments.files, "Meshes SOURCE REFERENCE ... in place of test pairs")
      ->expected(2, -1);
  render->add_option("--every", arguments.every, "Only every so many of the pairs")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  render->add_option("--index", arguments.indices, "Only these pairs")->check(CLI::NonNegativeNumber);
  render->add_option("--yaw", arguments.yaw_degrees, "Degrees to look from the character's left")
      ->capture_default_str();
  render->add_flag("--skeletons", arguments.skeletons, "Draw the predicted skeletons");
  render->add_flag("--weights", arguments.weights, "Colour by the predicted weights");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  absl::Status status = Interpret(arguments);
  if (status.ok() && *pairs) status = EvaluatePairs(arguments);
  if (status.ok() && *stages) status = EvaluateStages(arguments);
  if (status.ok() && *files) status = EvaluateFileList(arguments);
  if (status.ok() && *render) status = Render(arguments);
  if (status.ok()) return 0;
  fmt::print(stderr, "stance-eval: {}\n", std::string(status.message()));
  return 1;
}

}  // namespace stance

int main(int argc, char** argv) { return stance::Main(argc, argv); }
