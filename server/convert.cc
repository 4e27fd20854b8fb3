#include "server/convert.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "proto/wire/mesh_wire.h"
#include "proto/wire/rig_wire.h"
#include "server/status_map.h"
#include "server/wire_options.h"

namespace stance {
namespace {

constexpr absl::StatusCode kInvalid = absl::StatusCode::kInvalidArgument;
constexpr char kInvalidMesh[] = "INVALID_MESH";
constexpr uint32_t kMostInfluences = 24;

// The model that serves `method` and is called `name`; without either the default, without one of them the
// one that the other means.
absl::StatusOr<const ModelInfo*> FindModel(std::optional<Method> method, const std::string& name,
                                           const Catalog& catalog) {
  std::vector<std::string> names, methods;
  bool loaded = false;
  for (const ModelInfo& model : catalog.models) {
    const bool fits = !method || *method == model.method;
    if (fits && (name.empty() || name == model.name)) return &model;
    loaded = loaded || fits;
    names.push_back(model.name);
    methods.push_back(v1::Method_Name(MethodToWire(model.method)));
  }
  if (!loaded) {
    return FieldError(absl::StatusCode::kFailedPrecondition, "METHOD_NOT_LOADED", "options.method",
                      fmt::format("{} has no model on this server; loaded: {}",
                                  v1::Method_Name(MethodToWire(*method)), fmt::join(methods, ", ")));
  }
  return FieldError(
      absl::StatusCode::kNotFound, "MODEL_NOT_FOUND", "options.model",
      fmt::format("no model \"{}\"{}; there are: {}", name,
                  method ? " of " + v1::Method_Name(MethodToWire(*method)) : "", fmt::join(names, ", ")));
}

// The options that both requests share.
template <typename WireOptions>
absl::Status CommonOptions(const WireOptions& wire, const Catalog& catalog, TransferOptions& options,
                           std::string& model, BoneNaming& naming) {
  STANCE_ASSIGN_OR_RETURN(const std::optional<Method> method, MethodFromWire(wire.method()));
  STANCE_ASSIGN_OR_RETURN(const ModelInfo* const found, FindModel(method, wire.model(), catalog));
  options.method = found->method;
  model = found->name;
  STANCE_ASSIGN_OR_RETURN(options.smoothing, SmoothingFromWire(wire.smoothing()));
  if (wire.has_max_influences()) {
    if (wire.max_influences() > kMostInfluences) {
      return BadOption("options.max_influences",
                       fmt::format("{} is more than {}", wire.max_influences(), kMostInfluences));
    }
    options.max_influences = static_cast<int>(wire.max_influences());
  }
  STANCE_ASSIGN_OR_RETURN(naming, BoneNamingFromWire(wire.bone_naming()));
  options.limits = catalog.limits;
  return absl::OkStatus();
}

// The presence of a mesh and its axis; its content is for the worker.
absl::StatusOr<UpAxis> PlanMesh(bool present, const v1::Mesh& mesh, const std::string& field) {
  if (!present) return FieldError(kInvalid, kInvalidMesh, field, "is required");
  const absl::StatusOr<UpAxis> axis = UpAxisFromWire(mesh.up_axis());
  if (!axis.ok()) {
    return FieldError(kInvalid, kInvalidOption, field + ".up_axis", std::string(axis.status().message()));
  }
  return axis;
}

absl::Status PlanOutputs(const v1::TransferOptions& wire, TransferPlan& plan) {
  if (wire.outputs().empty()) plan.want_target = true;
  for (int i = 0; i < wire.outputs_size(); ++i) {
    switch (wire.outputs(i)) {
      case v1::TRANSFER_OUTPUT_TARGET:
        plan.want_target = true;
        break;
      case v1::TRANSFER_OUTPUT_SKELETONS:
        plan.want_skeletons = true;
        break;
      case v1::TRANSFER_OUTPUT_WEIGHTS:
        plan.want_weights = true;
        break;
      case v1::TRANSFER_OUTPUT_REFERENCE_WEIGHTS:
        plan.options.reference_weights = true;
        break;
      case v1::TRANSFER_OUTPUT_TRANSFORMS:
        plan.want_transforms = true;
        break;
      default:
        return UnknownValue(fmt::format("options.outputs[{}]", i), wire.outputs(i));
    }
  }
  return absl::OkStatus();
}

struct FormatPair {
  v1::OutputFormat output;
  MeshFormat file;
};
constexpr FormatPair kFileFormats[] = {{v1::OUTPUT_FORMAT_OBJ, MeshFormat::kObj},
                                       {v1::OUTPUT_FORMAT_PLY, MeshFormat::kPly},
                                       {v1::OUTPUT_FORMAT_OFF, MeshFormat::kOff},
                                       {v1::OUTPUT_FORMAT_STL, MeshFormat::kStl},
                                       {v1::OUTPUT_FORMAT_GLB, MeshFormat::kGlb}};

// The format asked for, or that of the source.
absl::StatusOr<v1::OutputFormat> PlanFormat(v1::OutputFormat wanted, const v1::Mesh& source) {
  if (wanted == v1::OUTPUT_FORMAT_UNSPECIFIED && source.data_case() == v1::Mesh::kFile) {
    const absl::StatusOr<MeshFormat> format = MeshFormatFromWire(source.file().format());
    if (!format.ok()) {
      return FieldError(kInvalid, kInvalidMesh, "source.file.format", std::string(format.status().message()));
    }
    for (const FormatPair& pair : kFileFormats) {
      if (pair.file == *format) return pair.output;
    }
  }
  if (wanted == v1::OUTPUT_FORMAT_UNSPECIFIED) return v1::OUTPUT_FORMAT_ARRAYS;
  if (!v1::OutputFormat_IsValid(wanted)) return UnknownValue("options.target_format", wanted);
  return wanted;
}

absl::Status EncodeMesh(const TriangleMesh& mesh, v1::OutputFormat format, v1::UpAxis up_axis,
                        v1::Mesh* wire) {
  wire->set_up_axis(up_axis);
  if (format == v1::OUTPUT_FORMAT_ARRAYS) {
    MeshToArrays(mesh, wire->mutable_arrays());
    return absl::OkStatus();
  }
  for (const FormatPair& pair : kFileFormats) {
    if (pair.output != format) continue;
    STANCE_ASSIGN_OR_RETURN(*wire->mutable_file()->mutable_content(), SerializeMesh(mesh, pair.file));
    wire->mutable_file()->set_format(MeshFormatToWire(pair.file));
  }
  return absl::OkStatus();
}

// All but the reference's, of a TransferRequest or an AnimateStart.
template <typename Request>
absl::StatusOr<TransferPlan> PlanSource(const Request& request, const Catalog& catalog) {
  TransferPlan plan;
  const v1::TransferOptions& wire = request.options();
  STANCE_RETURN_IF_ERROR(CommonOptions(wire, catalog, plan.options, plan.model, plan.bone_naming));
  STANCE_RETURN_IF_ERROR(PlanOutputs(wire, plan));
  STANCE_ASSIGN_OR_RETURN(plan.priority, PriorityFromWire(request.priority()));
  STANCE_ASSIGN_OR_RETURN(plan.options.twist, TwistFromWire(wire.twist()));
  STANCE_ASSIGN_OR_RETURN(plan.options.facing, FacingFromWire(wire.facing()));
  STANCE_ASSIGN_OR_RETURN(plan.options.ground, GroundFromWire(wire.ground()));
  STANCE_ASSIGN_OR_RETURN(plan.options.source_up, PlanMesh(request.has_source(), request.source(), "source"));
  STANCE_ASSIGN_OR_RETURN(plan.target_format, PlanFormat(wire.target_format(), request.source()));
  return plan;
}

}  // namespace

absl::StatusOr<TransferPlan> PlanTransfer(const v1::TransferRequest& request, const Catalog& catalog) {
  STANCE_ASSIGN_OR_RETURN(TransferPlan plan, PlanSource(request, catalog));
  STANCE_ASSIGN_OR_RETURN(plan.options.reference_up,
                          PlanMesh(request.has_reference(), request.reference(), "reference"));
  return plan;
}

absl::StatusOr<TransferPlan> PlanAnimate(const v1::AnimateStart& start, const Catalog& catalog) {
  return PlanSource(start, catalog);
}

absl::StatusOr<UpAxis> PlanReference(const v1::AnimateReference& reference) {
  return PlanMesh(reference.has_reference(), reference.reference(), "reference");
}

absl::StatusOr<RigPlan> PlanRig(const v1::RigRequest& request, const Catalog& catalog) {
  RigPlan plan;
  STANCE_RETURN_IF_ERROR(
      CommonOptions(request.options(), catalog, plan.options, plan.model, plan.bone_naming));
  STANCE_ASSIGN_OR_RETURN(plan.priority, PriorityFromWire(request.priority()));
  STANCE_ASSIGN_OR_RETURN(plan.options.source_up, PlanMesh(request.has_mesh(), request.mesh(), "mesh"));
  return plan;
}

int64_t EstimateVertices(const v1::Mesh& mesh) {
  constexpr int64_t kBytesPerVertex = 12;
  // A binary file holds 12 to 32 bytes per vertex and as many again for its two faces; text about twice that.
  constexpr int64_t kFileBytesPerVertex = 48;
  const int64_t vertices = mesh.data_case() == v1::Mesh::kFile
                               ? static_cast<int64_t>(mesh.file().content().size()) / kFileBytesPerVertex
                               : static_cast<int64_t>(mesh.arrays().positions().size()) / kBytesPerVertex;
  return std::max<int64_t>(1, vertices);
}

absl::StatusOr<TriangleMesh> DecodeMesh(const v1::Mesh& mesh, const std::string& field,
                                        const MeshLimits& limits) {
  absl::StatusOr<TriangleMesh> decoded = MeshFromWire(mesh, limits);
  if (!decoded.ok()) return NameField(decoded.status(), kInvalidMesh, field);
  return decoded;
}

absl::Status EncodeTransfer(const TransferPlan& plan, const TransferResult& result, const Catalog& catalog,
                            v1::UpAxis source_up, v1::TransferResponse* response) {
  if (plan.want_target) {
    STANCE_RETURN_IF_ERROR(
        EncodeMesh(result.target, plan.target_format, source_up, response->mutable_target()));
  }
  if (plan.want_skeletons) {
    const std::vector<std::string>& names = HumanBoneNames(plan.bone_naming);
    const std::vector<int>& parents = catalog.skeleton.parents();
    for (const auto& [rig, wire] :
         {std::pair{&result.source_rig, response->mutable_source_skeleton()},
          std::pair{&result.reference_rig, response->mutable_reference_skeleton()}}) {
      SkeletonToWire(names, parents, rig->joints, rig->confidence, wire);
    }
    SkeletonToWire(names, parents, result.target_joints, {}, response->mutable_target_skeleton());
  }
  if (plan.want_weights) WeightsToWire(result.source_rig.weights, response->mutable_weights());
  if (plan.options.reference_weights) {
    WeightsToWire(result.reference_rig.weights, response->mutable_reference_weights());
  }
  if (plan.want_transforms) TransformsToWire(result.transforms, response->mutable_joint_transforms());
  if (result.confidence) response->set_confidence(*result.confidence);
  for (const std::string& warning : result.warnings) response->add_warnings(warning);
  PhasesToWire(result.seconds, response->mutable_timings());
  response->set_model(plan.model);
  return absl::OkStatus();
}

void EncodeRig(const RigPlan& plan, const RigResult& result, const Catalog& catalog,
               v1::RigResponse* response) {
  SkeletonToWire(HumanBoneNames(plan.bone_naming), catalog.skeleton.parents(), result.rig.joints,
                 result.rig.confidence, response->mutable_skeleton());
  WeightsToWire(result.rig.weights, response->mutable_weights());
  for (const std::string& warning : result.warnings) response->add_warnings(warning);
  PhasesToWire(result.seconds, response->mutable_timings());
  response->set_model(plan.model);
}

v1::Method MethodToWire(Method method) {
  switch (method) {
    case Method::kSkeletal:
      return v1::METHOD_SKELETAL;
    case Method::kStance:
      return v1::METHOD_STANCE;
    case Method::kNeural:
      return v1::METHOD_NEURAL;
  }
  return v1::METHOD_UNSPECIFIED;
}

void ModelToWire(const ModelInfo& model, v1::Model* wire) {
  wire->set_name(model.name);
  wire->set_version(model.version);
  wire->set_method(MethodToWire(model.method));
  wire->set_joint_count(static_cast<uint32_t>(model.joint_count));
  wire->set_parameter_count(static_cast<uint64_t>(model.parameter_count));
  wire->set_sample_count(static_cast<uint64_t>(model.sample_count));
}

}  // namespace stance
