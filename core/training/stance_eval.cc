// stance-eval: measures methods and models on transfers with known answers, and renders them.

#include <fmt/format.h>

#include <cstdio>
#include <numbers>

#include "core/base/files.h"
#include "core/mesh/mesh_io.h"
#include "core/training/confidence_report.h"
#include "core/training/evaluation_ablations.h"
#include "core/training/evaluation_arguments.h"
#include "core/training/evaluation_bones.h"
#include "core/training/evaluation_confidence.h"
#include "core/training/evaluation_curve_plot.h"
#include "core/training/evaluation_curves.h"
#include "core/training/evaluation_files.h"
#include "core/training/evaluation_pairs.h"
#include "core/training/evaluation_pictures.h"
#include "core/training/evaluation_stages.h"

namespace stance {
namespace {

absl::StatusOr<std::unique_ptr<CharacterGenerator>> OpenGenerator(const EvaluationArguments& arguments) {
  if (arguments.data.empty() && (arguments.mpfb.empty() || arguments.bvh.empty())) {
    return absl::InvalidArgumentError("the characters are missing: give --data, or --mpfb and --bvh");
  }
  STANCE_ASSIGN_OR_RETURN(auto generator, arguments.data.empty()
                                              ? CharacterGenerator::FromData(arguments.mpfb, arguments.bvh)
                                              : CharacterGenerator::FromPack(arguments.data));
  STANCE_RETURN_IF_ERROR(generator->Check(arguments.characters));
  return generator;
}

absl::StatusOr<std::unique_ptr<Pipeline>> OpenPipeline(const EvaluationArguments& arguments) {
  return Pipeline::Load(arguments.model, {.threads = 1, .full_resolution = arguments.full_resolution});
}

absl::Status MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(fmt::format("{}: {}", folder.string(), error.message()));
}

// The model that the method in `arguments` runs on.
absl::StatusOr<ModelInfo> ChosenModel(const EvaluationArguments& arguments, const Pipeline& pipeline) {
  const Method method = arguments.transfer.method.value_or(pipeline.models().front().method);
  for (const ModelInfo& model : pipeline.models()) {
    if (model.method == method) return model;
  }
  return absl::InvalidArgumentError(
      fmt::format("--method: '{}' has no model in --model {}", MethodName(method), arguments.model.string()));
}

// What a table's reader must know of how it came to be.
std::string Heading(const EvaluationArguments& arguments, const Pipeline& pipeline,
                    const std::string& title) {
  const ModelInfo model = ChosenModel(arguments, pipeline).value_or(pipeline.models().front());
  return fmt::format(
      "# {}\n\nModel {} version {}, {} parameters, {}. Made by\n\n    {}\n\n", title, model.name,
      model.version, model.parameter_count,
      arguments.full_resolution ? "every vertex" : fmt::format("{} samples", model.sample_count),
      arguments.command_line);
}

// Prints the markdown and writes it and the CSV as <out>/<name>.md and .csv.
absl::Status WriteTables(const EvaluationArguments& arguments, const std::string& name,
                         const std::string& markdown, const std::string& csv) {
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

absl::Status EvaluatePairs(const EvaluationArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  std::vector<EvaluationRow> all;
  std::string markdown = Heading(arguments, *pipeline, "Transfer of test pairs");
  markdown +=
      "Identities and poses that training never saw; the source's stature scaled to 1.7 m; nothing "
      "centred.\n";
  for (const PoseMix mix : arguments.poses) {
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

absl::Status EvaluateAblations(const EvaluationArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto model, PoseModel::Load(arguments.model));
  std::vector<EvaluationRow> all;
  std::string markdown = fmt::format(
      "# METHOD_STANCE with single parts left out or true\n\nModel {} version {}. Made by\n\n    {}\n",
      model->manifest().name, model->manifest().version, arguments.command_line);
  for (const PoseMix mix : arguments.poses) {
    const PairEvaluationOptions options{.seed = arguments.seed,
                                        .pairs = arguments.pairs,
                                        .poses = {mix},
                                        .characters = arguments.characters,
                                        .threads = arguments.threads};
    const std::vector<EvaluationRow> rows = JudgePairs(
        *generator, options, [&model](const TransferPair& pair) { return AblateStance(*model, pair); },
        Progress(arguments.pairs));
    markdown += fmt::format("\n## {} poses\n\n{}", PoseMixName(mix), SummaryMarkdown(rows));
    all.insert(all.end(), rows.begin(), rows.end());
  }
  return WriteTables(arguments, "ablations", markdown, RowsCsv(all));
}

absl::Status EvaluateStages(const EvaluationArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  std::string markdown = Heading(arguments, *pipeline, "The rigger's stages on test characters");
  std::string csv;
  for (const PoseMix mix : arguments.poses) {
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

absl::Status EvaluateCurves(const EvaluationArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  CurveEvaluationOptions options{.seed = arguments.seed,
                                 .pairs = arguments.pairs,
                                 .curves = arguments.curves,
                                 .characters = arguments.characters,
                                 .transfer = arguments.transfer,
                                 .threads = arguments.threads};
  options.characters.poses = PoseMix::kModerate;
  int levels = 0;
  for (const Curve& curve : options.curves) levels += static_cast<int>(curve.levels.size());
  const std::vector<CurveRow> rows =
      stance::EvaluateCurves(*generator, *pipeline, options, Progress(levels * options.pairs));
  STANCE_RETURN_IF_ERROR(WriteTables(
      arguments, "curves",
      Heading(arguments, *pipeline, "Transfer of disturbed test pairs") +
          "Identities and poses that training never saw, source and reference both disturbed; the source's "
          "stature scaled to 1.7 m; nothing centred.\n\n" +
          CurvesMarkdown(options.curves, rows),
      CurvesCsv(rows)));
  if (arguments.out.empty()) return absl::OkStatus();
  return WriteFile(arguments.out / "curves.svg", CurvesSvg("Mean vertex error, mm", options.curves, rows));
}

absl::Status EvaluateFileList(const EvaluationArguments& arguments) {
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

absl::Status EvaluateBoneLengths(const EvaluationArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  STANCE_ASSIGN_OR_RETURN(const ModelInfo model, ChosenModel(arguments, *pipeline));
  std::string table = BonesHeader(), details, csv;
  for (const PoseMix mix : arguments.poses) {
    BoneEvaluationOptions options{.seed = arguments.seed,
                                  .identities = arguments.identities,
                                  .poses_each = arguments.poses_each,
                                  .character = arguments.characters,
                                  .transfer = arguments.transfer,
                                  .threads = arguments.threads};
    options.character.poses = mix;
    const BoneEvaluation bones =
        EvaluateBones(*generator, *pipeline, options, Progress(arguments.identities));
    table += BonesRow(fmt::format("{} {}, {} poses", model.name, model.version, PoseMixName(mix)), bones);
    details +=
        fmt::format("\n## {} poses\n\n{}", PoseMixName(mix), BonesMarkdown(bones, pipeline->skeleton()));
    csv += BonesCsv(MethodName(model.method), PoseMixName(mix), bones, pipeline->skeleton());
  }
  return WriteTables(
      arguments, "bones",
      Heading(arguments, *pipeline, "Bone lengths over the poses of test identities") + table + details,
      "method,poses,bone,length_mm,true_mm,deviation_mm,variation,error_mm\n" + csv);
}

absl::Status EvaluateConfidence(const EvaluationArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  STANCE_ASSIGN_OR_RETURN(const ModelInfo model, ChosenModel(arguments, *pipeline));
  const ConfidenceEvaluationOptions options{.seed = arguments.seed,
                                            .pairs = arguments.pairs,
                                            .poses = arguments.poses,
                                            .characters = arguments.characters,
                                            .transfer = arguments.transfer,
                                            .threads = arguments.threads};
  const int pairs = arguments.pairs * static_cast<int>(arguments.poses.size());
  STANCE_ASSIGN_OR_RETURN(auto observations,
                          ObserveConfidence(*generator, *pipeline, options, Progress(pairs)));
  const ConfidenceReport report = AnalyseConfidence(std::move(observations), model.confidence);
  STANCE_RETURN_IF_ERROR(
      WriteTables(arguments, "confidence",
                  Heading(arguments, *pipeline, "Confidence of test transfers") + ConfidenceMarkdown(report),
                  ConfidenceCsv(report)));
  if (arguments.out.empty()) return absl::OkStatus();
  return WriteFile(arguments.out / "confidence.svg", ConfidencePlot(report));
}

PictureOptions Pictures(const EvaluationArguments& arguments) {
  PictureOptions options{.skeletons = arguments.skeletons,
                         .weights = arguments.weights,
                         .source_up = arguments.transfer.source_up,
                         .reference_up = arguments.transfer.reference_up};
  options.render.yaw = arguments.yaw_degrees * std::numbers::pi / 180;
  return options;
}

absl::Status WritePicture(const EvaluationArguments& arguments, const std::string& name, const Image& image) {
  const std::filesystem::path path = arguments.out / (name + ".png");
  STANCE_RETURN_IF_ERROR(WritePng(image, path));
  fmt::print("{}\n", path.string());
  return absl::OkStatus();
}

absl::Status RenderFiles(const EvaluationArguments& arguments, const Pipeline& pipeline) {
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

absl::Status RenderPairs(const EvaluationArguments& arguments, const Pipeline& pipeline) {
  STANCE_ASSIGN_OR_RETURN(const auto generator, OpenGenerator(arguments));
  std::vector<int> indices = arguments.indices;
  for (int i = 0; arguments.indices.empty() && i < arguments.pairs; i += arguments.every)
    indices.push_back(i);
  for (const PoseMix mix : arguments.poses) {
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

absl::Status Render(const EvaluationArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const auto pipeline, OpenPipeline(arguments));
  STANCE_RETURN_IF_ERROR(MakeFolder(arguments.out));
  return arguments.files.empty() ? RenderPairs(arguments, *pipeline) : RenderFiles(arguments, *pipeline);
}

}  // namespace

int Main(int argc, char** argv) {
  EvaluationArguments arguments;
  if (const std::optional<int> exit_code = ParseEvaluationArguments(argc, argv, arguments)) return *exit_code;
  absl::Status status;
  switch (arguments.command) {
    case EvaluationCommand::kPairs:
      status = EvaluatePairs(arguments);
      break;
    case EvaluationCommand::kAblations:
      status = EvaluateAblations(arguments);
      break;
    case EvaluationCommand::kStages:
      status = EvaluateStages(arguments);
      break;
    case EvaluationCommand::kCurves:
      status = EvaluateCurves(arguments);
      break;
    case EvaluationCommand::kFiles:
      status = EvaluateFileList(arguments);
      break;
    case EvaluationCommand::kRender:
      status = Render(arguments);
      break;
    case EvaluationCommand::kBones:
      status = EvaluateBoneLengths(arguments);
      break;
    case EvaluationCommand::kConfidence:
      status = EvaluateConfidence(arguments);
      break;
  }
  if (status.ok()) return 0;
  fmt::print(stderr, "stance-eval: {}\n", std::string(status.message()));
  return 1;
}

}  // namespace stance

int main(int argc, char** argv) { return stance::Main(argc, argv); }
