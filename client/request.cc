#include "client/request.h"

#include <optional>

#include "proto/wire/mesh_wire.h"

namespace stance {
namespace {

// Unset is for the server to choose.
v1::Method MethodToWire(std::optional<Method> method) {
  if (!method) return v1::METHOD_UNSPECIFIED;
  switch (*method) {
    case Method::kSkeletal:
      return v1::METHOD_SKELETAL;
    case Method::kStance:
      return v1::METHOD_STANCE;
    case Method::kNeural:
      return v1::METHOD_NEURAL;
  }
  return v1::METHOD_UNSPECIFIED;
}

v1::Twist TwistToWire(Twist twist) {
  switch (twist) {
    case Twist::kInherited:
      return v1::TWIST_INHERITED;
    case Twist::kPaper:
      break;
  }
  return v1::TWIST_SMALLEST;
}

v1::Facing FacingToWire(Facing facing) {
  switch (facing) {
    case Facing::kSource:
      return v1::FACING_SOURCE;
    case Facing::kReference:
      break;
  }
  return v1::FACING_REFERENCE;
}

v1::Ground GroundToWire(Ground ground) {
  switch (ground) {
    case Ground::kSource:
      return v1::GROUND_SOURCE;
    case Ground::kFree:
      break;
  }
  return v1::GROUND_FREE;
}

// Only the parameter of the chosen kind may be set.
void SmoothingToWire(const SmoothingOptions& smoothing, v1::WeightSmoothing* wire) {
  switch (smoothing.kind) {
    case SmoothingKind::kMetric:
      wire->set_kind(v1::SMOOTHING_KIND_METRIC);
      wire->set_length(smoothing.length);
      break;
    case SmoothingKind::kHopwise:
      wire->set_kind(v1::SMOOTHING_KIND_HOPWISE);
      wire->set_lambda(smoothing.lambda);
      break;
    case SmoothingKind::kNone:
      wire->set_kind(v1::SMOOTHING_KIND_NONE);
      break;
  }
}

// The fields that both requests' options have in common.
template <typename WireOptions>
void OptionsToWire(const TransferOptions& options, const CallOptions& call, WireOptions* wire) {
  wire->set_method(MethodToWire(options.method));
  wire->set_model(call.model);
  SmoothingToWire(options.smoothing, wire->mutable_smoothing());
  wire->set_max_influences(static_cast<uint32_t>(options.max_influences));
  // Other names are given here (NameBones), whether or not the server knows them.
  wire->set_bone_naming(v1::BONE_NAMING_SMPL);
}

void GeometryToWire(const TriangleMesh& mesh, UpAxis up, v1::Mesh* wire) {
  TriangleMesh geometry;
  geometry.positions = mesh.positions;
  geometry.faces = mesh.faces;
  MeshToArrays(geometry, wire->mutable_arrays());
  wire->set_up_axis(UpAxisToWire(up));
}

// The target and what is known of it, without weights.
void TransferOptionsToWire(const TransferOptions& options, const CallOptions& call,
                           v1::TransferOptions* wire) {
  OptionsToWire(options, call, wire);
  wire->add_outputs(v1::TRANSFER_OUTPUT_TARGET);
  wire->add_outputs(v1::TRANSFER_OUTPUT_SKELETONS);
  wire->add_outputs(v1::TRANSFER_OUTPUT_TRANSFORMS);
  wire->set_twist(TwistToWire(options.twist));
  wire->set_facing(FacingToWire(options.facing));
  wire->set_ground(GroundToWire(options.ground));
  wire->set_target_format(v1::OUTPUT_FORMAT_ARRAYS);
}

void SourceToWire(const TriangleMesh& source, UpAxis up, v1::Mesh* wire) {
  GeometryToWire(source, up, wire);
  wire->mutable_arrays()->set_normals(source.normals.data(), source.normals.size() * sizeof(float));
}

}  // namespace

v1::TransferRequest MakeTransferRequest(const TriangleMesh& source, const TriangleMesh& reference,
                                        const TransferOptions& options, const CallOptions& call) {
  v1::TransferRequest request;
  SourceToWire(source, options.source_up, request.mutable_source());
  GeometryToWire(reference, options.reference_up, request.mutable_reference());
  TransferOptionsToWire(options, call, request.mutable_options());
  if (call.want_weights) request.mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_WEIGHTS);
  if (options.reference_weights) {
    request.mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_REFERENCE_WEIGHTS);
  }
  request.set_request_id(call.request_id);
  return request;
}

v1::AnimateRequest MakeAnimateStart(const TriangleMesh& source, const TransferOptions& options,
                                    const CallOptions& call) {
  v1::AnimateRequest message;
  SourceToWire(source, options.source_up, message.mutable_start()->mutable_source());
  TransferOptionsToWire(options, call, message.mutable_start()->mutable_options());
  message.mutable_start()->set_request_id(call.request_id);
  return message;
}

v1::AnimateRequest MakeAnimateReference(const TriangleMesh& reference, const TransferOptions& options) {
  v1::AnimateRequest message;
  GeometryToWire(reference, options.reference_up, message.mutable_reference()->mutable_reference());
  return message;
}

v1::RigRequest MakeRigRequest(const TriangleMesh& mesh, const TransferOptions& options,
                              const CallOptions& call) {
  v1::RigRequest request;
  GeometryToWire(mesh, options.source_up, request.mutable_mesh());
  OptionsToWire(options, call, request.mutable_options());
  request.set_request_id(call.request_id);
  return request;
}

}  // namespace stance
