#include "client/cli/arguments.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>

#include "core/mesh/mesh_io.h"

namespace stance {
namespace {

constexpr char kFooter[] =
    "Exit codes: 0 ok, 1 internal, 2 usage, 3 bad input, 4 file, 5 server or deadline, 6 below "
    "--min-confidence.";

const std::map<std::string, UpAxis> kAxes = {{"x", UpAxis::kX}, {"y", UpAxis::kY}, {"z", UpAxis::kZ}};
const std::map<std::string, SmoothingKind> kSmoothings = {
    {"metric", SmoothingKind::kMetric}, {"hopwise", SmoothingKind::kHopwise}, {"none", SmoothingKind::kNone}};
const std::map<std::string, BoneNaming> kNamings = {{"smpl", BoneNaming::kSmpl},
                                                    {"mixamo", BoneNaming::kMixamo},
                                                    {"vrm", BoneNaming::kVrm},
                                                    {"unreal", BoneNaming::kUnreal}};
const std::map<std::string, Facing> kFacings = {{"reference", Facing::kReference},
                                                {"source", Facing::kSource}};
const std::map<std::string, Ground> kGrounds = {{"free", Ground::kFree}, {"source", Ground::kSource}};
const std::map<std::string, Twist> kTwists = {{"paper", Twist::kPaper}, {"inherited", Twist::kInherited}};

// CLI11's own check turns a word into a value and, unlike this, prints the enumeration's number in its error.
template <typename T>
CLI::Option* AddChoice(CLI::App* app, const std::string& name, T* value,
                       const std::map<std::string, T>& choices, const std::string& description) {
  std::string words;
  for (const auto& [word, unused] : choices) words += (words.empty() ? "" : "|") + word;
  return app
      ->add_option_function<std::string>(
          name,
          [=, &choices](const std::string& word) {
            const auto found = choices.find(word);
            if (found == choices.end()) {
              throw CLI::ValidationError(name, fmt::format("\"{}\" is not one of {}", word, words));
            }
            *value = found->second;
          },
          description)
      ->type_name(words);
}

void AddBackend(CLI::App* app, BackendArguments* backend) {
  CLI::Option* server =
      app->add_option("--server", backend->server, "The server; default $STANCE_SERVER or localhost:50051")
          ->type_name("HOST:PORT");
  CLI::Option* local = app->add_flag("--local", backend->local, "Work in this process, without a server");
  local->excludes(server);
  AddCredentials(app, &backend->credentials);
  for (const char* name : {"--tls", "--tls-ca", "--tls-cert", "--tls-key", "--tls-name", "--token-file"}) {
    local->excludes(app->get_option(name));
  }
  app->add_option(
         "--model", backend->models,
         "With --local a folder of a model or of models, may be repeated; otherwise the model's name")
      ->type_name("DIR|NAME")
      ->allow_extra_args(false);
  app->add_option("--timeout", backend->timeout, "Longest wait for the server, seconds")
      ->type_name("S")
      ->excludes(local)
      ->capture_default_str();
  app->add_option("--threads", backend->threads, "Threads of --local; default: the CPUs allowed")
      ->type_name("N")
      ->needs(local);
}

void AddOptions(CLI::App* app, TransferOptions* options, std::string* method) {
  app->add_option("--method", *method,
                  "How to transfer: stance, skeletal or neural; default: the server's, or stance")
      ->type_name("NAME");
  AddChoice(app, "--smoothing", &options->smoothing.kind, kSmoothings, "How weights are smoothed; metric");
  app->add_option("--smoothing-length", options->smoothing.length,
                  "metric: diffusion length as a fraction of the stature, in (0, 1]")
      ->type_name("X")
      ->capture_default_str();
  app->add_option("--lambda", options->smoothing.lambda, "hopwise: diffusion parameter, in (0, 10000]")
      ->type_name("X")
      ->capture_default_str();
  app->add_option("--max-influences", options->max_influences,
                  "Most weights per vertex, 0 to 24; 0 keeps all")
      ->type_name("N")
      ->capture_default_str();
}

// Those that concern a source and a reference.
void AddPairOptions(CLI::App* app, TransferOptions* options) {
  AddChoice(app, "--source-up", &options->source_up, kAxes, "The source's up axis; y");
  AddChoice(app, "--reference-up", &options->reference_up, kAxes, "The reference's up axis; y");
  AddChoice(app, "--twist", &options->twist, kTwists, "How bones turn about their own axes; paper");
  AddChoice(app, "--facing", &options->facing, kFacings, "Whose way the target faces; reference");
  AddChoice(app, "--ground", &options->ground, kGrounds,
            "Whether the target stands as low as the source; free");
}

void AddBoneNames(CLI::App* app, BoneNaming* naming) {
  AddChoice(app, "--bone-names", naming, kNamings, "Names of the joints in the files written; smpl");
}

absl::Status Usage(const std::string& text) { return absl::InvalidArgumentError(text); }

absl::Status CheckBackend(BackendArguments* backend) {
  if (backend->server.empty() && !backend->local) backend->server = DefaultServer();
  if (!(backend->timeout > 0) || !(backend->timeout <= 86400)) {
    return Usage(fmt::format("--timeout: {:g} is not in (0, 86400]", backend->timeout));
  }
  if (!backend->local && backend->models.size() > 1) {
    return Usage(fmt::format("--model: {} of them without --local", backend->models.size()));
  }
  if (backend->threads < 0) return Usage(fmt::format("--threads: {} is negative", backend->threads));
  return absl::OkStatus();
}

absl::Status CheckOptions(const CLI::App& app, const std::string& method, TransferOptions* options) {
  if (!method.empty()) {
    const absl::StatusOr<Method> parsed = MethodFromName(method);
    if (!parsed.ok()) return Usage(fmt::format("--method: {}", std::string(parsed.status().message())));
    options->method = *parsed;
  }
  if (options->method && *options->method != Method::kSkeletal) {
    for (const char* name : {"--smoothing", "--smoothing-length", "--lambda", "--twist"}) {
      const CLI::Option* option = app.get_option_no_throw(name);
      if (option != nullptr && option->count() > 0)
        return Usage(fmt::format("{}: not with --method {}", name, method));
    }
  }
  const SmoothingOptions& smoothing = options->smoothing;
  if (app.count("--smoothing-length") > 0 && smoothing.kind != SmoothingKind::kMetric) {
    return Usage("--smoothing-length: only with --smoothing metric");
  }
  if (app.count("--lambda") > 0 && smoothing.kind != SmoothingKind::kHopwise) {
    return Usage("--lambda: only with --smoothing hopwise");
  }
  if (!(smoothing.length > 0 && smoothing.length <= 1)) {
    return Usage(fmt::format("--smoothing-length: {:g} is not in (0, 1]", smoothing.length));
  }
  if (!(smoothing.lambda > 0 && smoothing.lambda <= 10000)) {
    return Usage(fmt::format("--lambda: {:g} is not in (0, 10000]", smoothing.lambda));
  }
  if (options->max_influences < 0 || options->max_influences > 24) {
    return Usage(fmt::format("--max-influences: {} is not in 0 to 24", options->max_influences));
  }
  return absl::OkStatus();
}

std::string Extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// INVALID_ARGUMENT unless the extension of `path`, which may be empty, is one of `allowed`.
absl::Status CheckExtension(const std::string& option, const std::string& path,
                            const std::set<std::string>& allowed) {
  if (path.empty() || allowed.contains(Extension(path))) return absl::OkStatus();
  return Usage(fmt::format("{}: {} does not end in {}", option, path, fmt::join(allowed, " or ")));
}

// Two outputs under one name would overwrite each other.
absl::Status CheckDistinct(const std::vector<std::string>& paths) {
  std::set<std::filesystem::path> seen;
  for (const std::string& path : paths) {
    if (!path.empty() && !seen.insert(std::filesystem::absolute(path).lexically_normal()).second) {
      return Usage(fmt::format("{}: named for two outputs", path));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckTransfer(const CLI::App& app, const std::string& method, TransferArguments* arguments) {
  STANCE_RETURN_IF_ERROR(CheckBackend(&arguments->backend));
  STANCE_RETURN_IF_ERROR(CheckOptions(app, method, &arguments->options));
  for (const std::string& output : arguments->outputs) {
    const absl::StatusOr<MeshFormat> format = MeshFormatFromName(output);
    if (!format.ok()) {
      return Usage(fmt::format("--output: {}: {}", output, std::string(format.status().message())));
    }
  }
  if (!(arguments->min_confidence >= 0 && arguments->min_confidence <= 1)) {
    return Usage(fmt::format("--min-confidence: {:g} is not in [0, 1]", arguments->min_confidence));
  }
  if (arguments->min_confidence > 0 &&
      arguments->options.method.value_or(Method::kStance) != Method::kStance) {
    return Usage(fmt::format("--min-confidence: the method {} does not know its confidence", method));
  }
  STANCE_RETURN_IF_ERROR(CheckExtension("--skeleton", arguments->skeleton, {".json"}));
  STANCE_RETURN_IF_ERROR(CheckExtension("--weights", arguments->weights, {".csv", ".json"}));
  STANCE_RETURN_IF_ERROR(CheckExtension("--view", arguments->view, {".html", ".png"}));
  std::vector<std::string> all = arguments->outputs;
  all.insert(all.end(), {arguments->skeleton, arguments->weights, arguments->view});
  return CheckDistinct(all);
}

absl::Status CheckAnimate(const CLI::App& app, const std::string& method, AnimateArguments* arguments) {
  STANCE_RETURN_IF_ERROR(CheckBackend(&arguments->backend));
  STANCE_RETURN_IF_ERROR(CheckOptions(app, method, &arguments->options));
  if (arguments->format.empty()) arguments->format = Extension(arguments->source).erase(0, 1);
  const absl::StatusOr<MeshFormat> format = MeshFormatFromName("target." + arguments->format);
  if (format.ok()) return absl::OkStatus();
  return Usage(fmt::format("--format: {}: {}", arguments->format, std::string(format.status().message())));
}

absl::Status CheckRig(const CLI::App& app, const std::string& method, RigArguments* arguments) {
  STANCE_RETURN_IF_ERROR(CheckBackend(&arguments->backend));
  STANCE_RETURN_IF_ERROR(CheckOptions(app, method, &arguments->options));
  for (const std::string& output : arguments->outputs) {
    STANCE_RETURN_IF_ERROR(CheckExtension("--output", output, {".glb", ".json"}));
  }
  STANCE_RETURN_IF_ERROR(CheckExtension("--weights", arguments->weights, {".csv", ".json"}));
  std::vector<std::string> all = arguments->outputs;
  all.push_back(arguments->weights);
  return CheckDistinct(all);
}

absl::Status CheckRender(const RenderArguments& arguments) {
  if (!arguments.captions.empty() && arguments.captions.size() != arguments.meshes.size()) {
    return Usage(
        fmt::format("--captions: {} for {} meshes", arguments.captions.size(), arguments.meshes.size()));
  }
  if (arguments.columns < 0) return Usage(fmt::format("--columns: {} is negative", arguments.columns));
  return CheckExtension("--output", arguments.output, {".png"});
}

}  // namespace

std::string DefaultServer() {
  const char* server = std::getenv("STANCE_SERVER");
  return server != nullptr && *server != '\0' ? server : "localhost:50051";
}

absl::StatusOr<Command> ParseArguments(int argc, const char* const* argv) {
  CLI::App app("Gives a 3D character the pose of another.", "stance");
  app.footer(kFooter);
  app.require_subcommand(1);
  app.set_version_flag("--version", "stance " STANCE_VERSION);
  std::string method;

  TransferArguments transfer;
  CLI::App* transfer_app = app.add_subcommand("transfer", "Write SOURCE in the pose of REFERENCE");
  transfer_app->add_option("SOURCE", transfer.source, "Mesh whose shape is kept")->required();
  transfer_app->add_option("REFERENCE", transfer.reference, "Mesh whose pose is taken")->required();
  transfer_app
      ->add_option("-o,--output", transfer.outputs,
                   "Mesh to write (.obj .ply .off .stl .glb); may be repeated")
      ->type_name("TARGET")
      ->allow_extra_args(false)
      ->required();
  AddBackend(transfer_app, &transfer.backend);
  AddOptions(transfer_app, &transfer.options, &method);
  AddBoneNames(transfer_app, &transfer.bone_naming);
  AddPairOptions(transfer_app, &transfer.options);
  transfer_app
      ->add_option("--min-confidence", transfer.min_confidence,
                   "Exit with 6, outputs written, if the confidence is less or not known; in [0, 1]")
      ->type_name("X");
  transfer_app->add_option("--skeleton", transfer.skeleton, "Write the skeletons and transforms (.json)")
      ->type_name("FILE");
  transfer_app->add_option("--weights", transfer.weights, "Write the skinning weights (.json .csv)")
      ->type_name("FILE");
  transfer_app->add_option("--view", transfer.view, "Draw source, reference and target (.png .html)")
      ->type_name("FILE");
  transfer_app->add_flag("--quiet", transfer.quiet, "No summary and no warnings");
  transfer_app->add_flag("--json", transfer.json, "The summary as JSON");

  AnimateArguments animate;
  CLI::App* animate_app =
      app.add_subcommand("animate", "Write SOURCE in the pose of each REFERENCE, rigging it once");
  animate_app->add_option("SOURCE", animate.source, "Mesh whose shape is kept")->required();
  animate_app
      ->add_option("REFERENCE", animate.references, "Meshes whose poses are taken, or folders of meshes")
      ->required();
  animate_app
      ->add_option("-o,--output", animate.output, "Folder for the targets, each named as its reference")
      ->type_name("FOLDER")
      ->required();
  animate_app->add_option("--format", animate.format, "obj, ply, off, stl or glb; default: the source's")
      ->type_name("NAME");
  AddBackend(animate_app, &animate.backend);
  AddOptions(animate_app, &animate.options, &method);
  AddPairOptions(animate_app, &animate.options);
  animate_app->add_flag("--quiet", animate.quiet, "No lines for what was written");

  RigArguments rig;
  CLI::App* rig_app = app.add_subcommand("rig", "Write the skeleton and weights of MESH");
  rig_app->add_option("MESH", rig.mesh, "The character")->required();
  rig_app->add_option("-o,--output", rig.outputs, "Rig to write (.glb: skinned mesh, .json); may be repeated")
      ->type_name("RIG")
      ->allow_extra_args(false)
      ->required();
  AddBackend(rig_app, &rig.backend);
  AddOptions(rig_app, &rig.options, &method);
  AddBoneNames(rig_app, &rig.bone_naming);
  AddChoice(rig_app, "--up", &rig.options.source_up, kAxes, "The mesh's up axis; y");
  rig_app->add_option("--weights", rig.weights, "Write the skinning weights (.json .csv)")->type_name("FILE");
  rig_app->add_flag("--quiet", rig.quiet, "No summary and no warnings");
  rig_app->add_flag("--json", rig.json, "The summary as JSON");

  InfoArguments info;
  CLI::App* info_app = app.add_subcommand("info", "Print what a mesh file holds");
  info_app->add_option("MESH", info.mesh, "The file")->required();
  info_app->add_flag("--json", info.json, "As JSON");

  RenderArguments render;
  CLI::App* render_app = app.add_subcommand("render", "Draw meshes side by side");
  render_app->add_option("MESH", render.meshes, "The files")->required();
  render_app->add_option("-o,--output", render.output, "Picture to write (.png)")
      ->type_name("FILE")
      ->required();
  render_app->add_option("--captions", render.captions, "One per mesh")->type_name("TEXT...");
  AddChoice(render_app, "--up", &render.up, kAxes, "The meshes' up axis; y");
  render_app->add_option("--yaw", render.yaw, "Turn of the camera about the up axis, degrees");
  render_app->add_option("--pitch", render.pitch, "Tilt of the camera, degrees; positive looks down");
  render_app->add_option("--columns", render.columns, "Pictures per row; 0: all in one")
      ->capture_default_str();

  ServerInfoArguments server_info;
  CLI::App* server_app = app.add_subcommand("server-info", "Print a server's models and limits");
  server_app->add_option("--server", server_info.backend.server, "The server")->type_name("HOST:PORT");
  AddCredentials(server_app, &server_info.backend.credentials);
  server_app->add_option("--timeout", server_info.backend.timeout, "Longest wait, seconds")
      ->type_name("S")
      ->capture_default_str();
  server_app->add_flag("--json", server_info.json, "As JSON");

  ReloadArguments reload;
  CLI::App* reload_app = app.add_subcommand("reload", "Have a server load its models again");
  reload_app
      ->add_option("--server", reload.backend.server, "The address that the server's admin.listen names")
      ->type_name("HOST:PORT")
      ->required();
  AddCredentials(reload_app, &reload.backend.credentials);
  reload_app->add_option("--timeout", reload.backend.timeout, "Longest wait, seconds")
      ->type_name("S")
      ->capture_default_str();
  reload_app->add_flag("--json", reload.json, "As JSON");

  try {
    app.parse(argc, const_cast<char**>(argv));
  } catch (const CLI::CallForHelp&) {
    const std::vector<CLI::App*> chosen = app.get_subcommands();
    return TextToPrint{chosen.empty() ? app.help() : chosen.front()->help()};
  } catch (const CLI::CallForVersion& version) {
    return TextToPrint{std::string(version.what()) + "\n"};
  } catch (const CLI::Error& error) {
    return Usage(error.what());
  }

  if (transfer_app->parsed()) {
    STANCE_RETURN_IF_ERROR(CheckTransfer(*transfer_app, method, &transfer));
    return transfer;
  }
  if (animate_app->parsed()) {
    STANCE_RETURN_IF_ERROR(CheckAnimate(*animate_app, method, &animate));
    return animate;
  }
  if (rig_app->parsed()) {
    STANCE_RETURN_IF_ERROR(CheckRig(*rig_app, method, &rig));
    return rig;
  }
  if (render_app->parsed()) {
    STANCE_RETURN_IF_ERROR(CheckRender(render));
    return render;
  }
  if (server_app->parsed()) {
    STANCE_RETURN_IF_ERROR(CheckBackend(&server_info.backend));
    return server_info;
  }
  if (reload_app->parsed()) {
    STANCE_RETURN_IF_ERROR(CheckBackend(&reload.backend));
    return reload;
  }
  return info;
}

}  // namespace stance
