#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/input.h"
#include "client/cli/output_files.h"
#include "client/cli/rig_files.h"
#include "client/cli/summary.h"
#include "client/cli/view.h"
#include "core/mesh/mesh_io.h"
#include "core/skeleton/skeleton.h"
#include "core/transfer/skinned_glb.h"

namespace stance {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Before any work: a mistake in a path should not cost a transfer.
absl::Status CheckOutputs(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (!path.empty()) STANCE_RETURN_IF_ERROR(FileError(OutputFiles::Check(path)));
  }
  return absl::OkStatus();
}

std::vector<std::string> AllOutputs(const TransferArguments& arguments) {
  std::vector<std::string> paths = arguments.outputs;
  for (const std::string& path : {arguments.skeleton, arguments.weights, arguments.view}) {
    if (!path.empty()) paths.push_back(path);
  }
  return paths;
}

std::vector<std::string> AllOutputs(const RigArguments& arguments) {
  std::vector<std::string> paths = arguments.outputs;
  if (!arguments.weights.empty()) paths.push_back(arguments.weights);
  return paths;
}

absl::Status StageMesh(const TriangleMesh& mesh, const std::string& path, OutputFiles* files) {
  STANCE_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatFromName(path));
  STANCE_ASSIGN_OR_RETURN(const std::string bytes, SerializeMesh(mesh, format));
  return files->Stage(path, bytes);
}

absl::Status StageWeights(const JointTree& joints, const RowMatrix& weights, const std::string& path,
                          OutputFiles* files) {
  if (path.empty()) return absl::OkStatus();
  return files->Stage(path,
                      path.ends_with(".json") ? WeightsJson(joints, weights) : WeightsCsv(joints, weights));
}

absl::Status StageView(const TransferArguments& arguments, const TriangleMesh& source,
                       const TriangleMesh& reference, const TriangleMesh& target, OutputFiles* files) {
  if (arguments.view.empty()) return absl::OkStatus();
  const std::vector<ViewItem> items = {{&source, arguments.options.source_up, "source"},
                                       {&reference, arguments.options.reference_up, "reference"},
                                       {&target, arguments.options.source_up, "target"}};
  if (arguments.view.ends_with(".html")) return files->Stage(arguments.view, ViewHtml(items));
  return files->StageWith(arguments.view,
                          [&](const std::filesystem::path& path) { return WriteViewPng(items, {}, path); });
}

absl::Status WriteOutputs(const TransferArguments& arguments, const TriangleMesh& source,
                          const TriangleMesh& reference, const TransferAnswer& answer) {
  OutputFiles files;
  for (const std::string& path : arguments.outputs) {
    STANCE_RETURN_IF_ERROR(StageMesh(answer.result.target, path, &files));
  }
  if (!arguments.skeleton.empty()) {
    STANCE_RETURN_IF_ERROR(files.Stage(arguments.skeleton, SkeletonJson(answer)));
  }
  STANCE_RETURN_IF_ERROR(
      StageWeights(answer.joints, answer.result.source_rig.weights, arguments.weights, &files));
  STANCE_RETURN_IF_ERROR(StageView(arguments, source, reference, answer.result.target, &files));
  return files.Commit();
}

absl::Status WriteOutputs(const RigArguments& arguments, const TriangleMesh& mesh, const RigAnswer& answer) {
  OutputFiles files;
  for (const std::string& path : arguments.outputs) {
    if (path.ends_with(".json")) {
      STANCE_RETURN_IF_ERROR(files.Stage(path, RigJson(answer)));
      continue;
    }
    const Skeleton skeleton(answer.joints.names, answer.joints.parents);
    STANCE_ASSIGN_OR_RETURN(const std::string bytes,
                            SerializeSkinnedGlb(mesh, skeleton, answer.result.rig, answer.joints.names));
    STANCE_RETURN_IF_ERROR(files.Stage(path, bytes));
  }
  STANCE_RETURN_IF_ERROR(StageWeights(answer.joints, answer.result.rig.weights, arguments.weights, &files));
  return files.Commit();
}

// Of outputs that are written.
absl::Status CheckConfidence(const TransferResult& result, double least) {
  if (least == 0 || (result.confidence && *result.confidence >= least)) return absl::OkStatus();
  const std::string found =
      result.confidence ? fmt::format("the confidence is {:g}, less than {:g}", *result.confidence, least)
                        : fmt::format("model {} does not know its confidence", result.model);
  return UnsureError(
      absl::FailedPreconditionError(fmt::format("--min-confidence: {}; the outputs were written", found)));
}

}  // namespace

absl::Status RunTransfer(const TransferArguments& arguments) {
  const Clock::time_point start = Clock::now();
  const std::vector<std::string> paths = AllOutputs(arguments);
  STANCE_RETURN_IF_ERROR(CheckOutputs(paths));
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh source, ReadInput(arguments.source));
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh reference, ReadInput(arguments.reference));
  STANCE_ASSIGN_OR_RETURN(const std::unique_ptr<Backend> backend, MakeBackend(arguments.backend));
  absl::StatusOr<TransferAnswer> answer =
      backend->Transfer(source, reference, arguments.options, !arguments.weights.empty());
  if (!answer.ok()) {
    return NameFile(answer.status(), {{"source", arguments.source}, {"reference", arguments.reference}});
  }
  NameBones(arguments.bone_naming, &answer->joints);
  STANCE_RETURN_IF_ERROR(FileError(WriteOutputs(arguments, source, reference, *answer)));
  if (!arguments.quiet) {
    const TransferResult& result = answer->result;
    PrintSummary({.vertices = result.target.vertex_count(),
                  .faces = result.target.face_count(),
                  .outputs = paths,
                  .warnings = result.warnings,
                  .model = result.model,
                  .confidence = result.confidence,
                  .request_id = answer->request_id,
                  .phases = result.seconds,
                  .service = answer->service,
                  .wall_seconds = SecondsSince(start)},
                 arguments.json);
  }
  return CheckConfidence(answer->result, arguments.min_confidence);
}

absl::Status RunRig(const RigArguments& arguments) {
  const Clock::time_point start = Clock::now();
  const std::vector<std::string> paths = AllOutputs(arguments);
  STANCE_RETURN_IF_ERROR(CheckOutputs(paths));
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh mesh, ReadInput(arguments.mesh));
  STANCE_ASSIGN_OR_RETURN(const std::unique_ptr<Backend> backend, MakeBackend(arguments.backend));
  absl::StatusOr<RigAnswer> answer = backend->Rig(mesh, arguments.options);
  if (!answer.ok()) return NameFile(answer.status(), {{"mesh", arguments.mesh}});
  NameBones(arguments.bone_naming, &answer->joints);
  STANCE_RETURN_IF_ERROR(FileError(WriteOutputs(arguments, mesh, *answer)));
  if (!arguments.quiet) {
    PrintSummary({.vertices = mesh.vertex_count(),
                  .faces = mesh.face_count(),
                  .outputs = paths,
                  .warnings = answer->result.warnings,
                  .model = answer->result.model,
                  .confidence = std::nullopt,
                  .request_id = answer->request_id,
                  .phases = answer->result.seconds,
                  .service = answer->service,
                  .wall_seconds = SecondsSince(start)},
                 arguments.json);
  }
  return absl::OkStatus();
}

}  // namespace stance
