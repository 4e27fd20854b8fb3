#include "core/training/evaluation_arguments.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "core/base/threads.h"

namespace stance {
namespace {

// Options whose words stand for enumerators.
struct Words {
  std::string method, poses = "both", twist = "paper", smoothing = "metric";
  std::string source_up = "y", reference_up = "y";
  std::vector<std::string> curves = {};  // none: all
};

std::vector<PoseMix> PoseMixes(const std::string& name) {
  if (name == "moderate") return {PoseMix::kModerate};
  if (name == "hard") return {PoseMix::kHard};
  return {PoseMix::kModerate, PoseMix::kHard};
}

std::vector<std::string> CurveNames() {
  std::vector<std::string> names;
  for (const Curve& curve : AllCurves()) names.push_back(curve.name);
  return names;
}

// In the order of AllCurves(), each once.
std::vector<Curve> CurvesNamed(const std::vector<std::string>& names) {
  std::vector<Curve> curves;
  for (const Curve& curve : AllCurves()) {
    if (names.empty() || std::find(names.begin(), names.end(), curve.name) != names.end()) {
      curves.push_back(curve);
    }
  }
  return curves;
}

UpAxis UpAxisFromName(const std::string& name) {
  if (name == "z") return UpAxis::kZ;
  return name == "x" ? UpAxis::kX : UpAxis::kY;
}

absl::Status Interpret(const Words& words, EvaluationArguments& arguments) {
  TransferOptions& transfer = arguments.transfer;
  if (!words.method.empty()) {
    STANCE_ASSIGN_OR_RETURN(transfer.method, MethodFromName(words.method));
  }
  transfer.twist = words.twist == "inherited" ? Twist::kInherited : Twist::kPaper;
  if (words.smoothing == "hopwise") transfer.smoothing.kind = SmoothingKind::kHopwise;
  if (words.smoothing == "none") transfer.smoothing.kind = SmoothingKind::kNone;
  transfer.source_up = UpAxisFromName(words.source_up);
  transfer.reference_up = UpAxisFromName(words.reference_up);
  arguments.poses = PoseMixes(words.poses);
  arguments.curves = CurvesNamed(words.curves);
  return absl::OkStatus();
}

void AddModelOptions(CLI::App& command, EvaluationArguments& arguments, Words& words) {
  TransferOptions& transfer = arguments.transfer;
  command.add_option("--model", arguments.model, "The model's folder")->required();
  command.add_option("--method", words.method, "The method [the model's own]");
  command.add_option("--twist", words.twist, "Rotation about a bone's own axis")
      ->check(CLI::IsMember({"paper", "inherited"}))
      ->capture_default_str();
  command.add_option("--smoothing", words.smoothing, "How weights are smoothed")
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

void AddUpAxisOptions(CLI::App& command, Words& words) {
  for (auto& [name, value] :
       {std::pair{"--source-up", &words.source_up}, std::pair{"--reference-up", &words.reference_up}}) {
    command.add_option(name, *value, "The axis that points up")
        ->check(CLI::IsMember({"x", "y", "z"}))
        ->capture_default_str();
  }
}

void AddDataOptions(CLI::App& command, EvaluationArguments& arguments, int& pairs) {
  command.add_option("--data", arguments.data, "Pack written by 'stance-train pack'");
  command.add_option("--mpfb", arguments.mpfb, "In place of a pack: folder with MPFB's data");
  command.add_option("--bvh", arguments.bvh, "In place of a pack: folder with BVH clips");
  command.add_option("--pairs", pairs, "Pairs (or characters) of each pose mix")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command.add_option("--seed", arguments.seed, "Seed of the test characters")->capture_default_str();
  command
      .add_option("--rigged-share", arguments.characters.rigged_share,
                  "Share of held-out rigged characters; 1: no others")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("!--no-global-rotation", arguments.characters.global_rotation,
                   "Characters keep facing +z");
}

void AddCharacterOptions(CLI::App& command, EvaluationArguments& arguments, Words& words) {
  AddDataOptions(command, arguments, arguments.pairs);
  command.add_option("--poses", words.poses, "Pose mix")
      ->check(CLI::IsMember({"moderate", "hard", "both"}))
      ->capture_default_str();
  command.add_option("--vertices", arguments.characters.vertices, "About so many vertices; 0: the full body")
      ->capture_default_str();
  command.add_option("--noise", arguments.characters.noise, "Noise along normals, metres")
      ->capture_default_str();
}

absl::Status CheckConfidence(const EvaluationArguments& arguments) {
  if (arguments.transfer.method.value_or(Method::kStance) != Method::kStance) {
    return absl::InvalidArgumentError(
        fmt::format("--method: '{}' does not know its confidence", MethodName(*arguments.transfer.method)));
  }
  if (arguments.pairs < 2) {
    return absl::InvalidArgumentError(
        fmt::format("--pairs: {} leaves no pair to check the calibration on", arguments.pairs));
  }
  return absl::OkStatus();
}

}  // namespace

std::optional<int> ParseEvaluationArguments(int argc, const char* const* argv,
                                            EvaluationArguments& arguments) {
  arguments.threads = CpuQuota();
  for (int i = 0; i < argc; ++i) {
    arguments.command_line +=
        i == 0 ? std::filesystem::path(argv[0]).filename().string() : fmt::format(" {}", argv[i]);
  }
  Words words;
  Words curve_words;
  curve_words.poses = "moderate";
  int curve_pairs = 20;
  CLI::App app("Measures pose transfer on pairs with known answers.", "stance-eval");
  app.require_subcommand(1);

  CLI::App* pairs = app.add_subcommand("pairs", "Errors of transfers between generated test characters");
  CLI::App* stages =
      app.add_subcommand("stages", "Errors of weights and joints on generated test characters");
  CLI::App* curves =
      app.add_subcommand("curves", "Errors of transfers between ever more disturbed test characters");
  CLI::App* files = app.add_subcommand("files", "Errors of transfers between meshes in files");
  CLI::App* render = app.add_subcommand("render", "Pictures of transfers");
  for (CLI::App* command : {pairs, stages, files, render}) AddModelOptions(*command, arguments, words);
  AddModelOptions(*curves, arguments, curve_words);
  for (CLI::App* command : {pairs, stages, render}) AddCharacterOptions(*command, arguments, words);
  AddDataOptions(*curves, arguments, curve_pairs);
  for (CLI::App* command : {files, render}) AddUpAxisOptions(*command, words);
  for (CLI::App* command : {pairs, stages, files}) {
    command->add_option("-o,--out", arguments.out, "Folder for the tables as markdown and CSV");
  }
  curves->add_option("-o,--out", arguments.out, "Folder for the table as markdown and CSV, and its plot");
  curves->add_option("--curve", curve_words.curves, "Only this disturbance; may be repeated")
      ->check(CLI::IsMember(CurveNames()));
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

  CLI::App* bones = app.add_subcommand("bones", "Steadiness of bone lengths over an identity's poses");
  CLI::App* confidence =
      app.add_subcommand("confidence", "What a method's confidence is worth, and its calibration");
  CLI::App* ablations =
      app.add_subcommand("ablations", "Errors of METHOD_STANCE with single parts left out or true");
  for (CLI::App* command : {bones, confidence, ablations}) {
    AddModelOptions(*command, arguments, words);
    AddCharacterOptions(*command, arguments, words);
    command->add_option("-o,--out", arguments.out, "Folder for the tables as markdown and CSV");
  }
  bones->remove_option(bones->get_option("--pairs"));
  bones->add_option("--identities", arguments.identities, "Identities of each pose mix")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  bones->add_option("--poses-each", arguments.poses_each, "Poses of each identity")
      ->check(CLI::Range(2, 100'000))
      ->capture_default_str();

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  if (arguments.files.size() % 2 != 0) {
    fmt::print(stderr, "stance-eval: --files: {} has no reference after it\n",
               arguments.files.back().string());
    return 2;
  }
  if (const absl::Status status = Interpret(*curves ? curve_words : words, arguments); !status.ok()) {
    fmt::print(stderr, "stance-eval: {}\n", std::string(status.message()));
    return 2;
  }
  if (*confidence) {
    if (const absl::Status status = CheckConfidence(arguments); !status.ok()) {
      fmt::print(stderr, "stance-eval: {}\n", std::string(status.message()));
      return 2;
    }
  }
  if (*curves) arguments.pairs = curve_pairs;
  for (const auto& [command, value] : std::initializer_list<std::pair<CLI::App*, EvaluationCommand>>{
           {pairs, EvaluationCommand::kPairs},
           {stages, EvaluationCommand::kStages},
           {curves, EvaluationCommand::kCurves},
           {files, EvaluationCommand::kFiles},
           {render, EvaluationCommand::kRender},
           {bones, EvaluationCommand::kBones},
           {confidence, EvaluationCommand::kConfidence},
           {ablations, EvaluationCommand::kAblations}}) {
    if (*command) arguments.command = value;
  }
  return std::nullopt;
}

}  // namespace stance
