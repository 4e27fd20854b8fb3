#include "client/response.h"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "proto/wire/mesh_wire.h"
#include "proto/wire/rig_wire.h"

namespace stance {
namespace {

// The server's answer is wrong, which is not the caller's fault: every error becomes INTERNAL.
absl::Status BadAnswer(const char* field, const absl::Status& status) {
  return absl::InternalError(fmt::format("the server's answer: {}.{}", field, std::string(status.message())));
}

absl::Status BadCount(const char* field, int64_t got, int64_t want) {
  return absl::InternalError(fmt::format("the server's answer: {} has {} rows, want {}", field, got, want));
}

absl::Status ReadWeights(const v1::SkinWeights& wire, const char* field, RowMatrix* weights) {
  absl::StatusOr<RowMatrix> read = WeightsFromWire(wire);
  if (!read.ok()) return BadAnswer(field, read.status());
  *weights = *std::move(read);
  return absl::OkStatus();
}

// `confidence` may be null.
absl::Status ReadSkeleton(const v1::Skeleton& wire, const char* field, JointTree* tree, Points* joints,
                          Eigen::VectorXf* confidence) {
  absl::StatusOr<PlacedSkeleton> read = SkeletonFromWire(wire);
  if (!read.ok()) return BadAnswer(field, read.status());
  tree->names = std::move(read->names);
  tree->parents = std::move(read->parents);
  *joints = std::move(read->joints);
  if (confidence != nullptr) *confidence = std::move(read->confidence);
  return absl::OkStatus();
}

ServiceSeconds ReadServiceSeconds(const v1::PhaseTimings& wire) {
  return {.queue = wire.queue_seconds(), .decode = wire.decode_seconds(), .encode = wire.encode_seconds()};
}

// "METHOD_SKELETAL" -> "skeletal".
std::string LowerSuffix(const std::string& name, size_t prefix) {
  std::string text = name.size() > prefix ? name.substr(prefix) : name;
  for (char& c : text) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return text;
}

std::string MethodWord(v1::Method method) { return LowerSuffix(v1::Method_Name(method), 7); }

std::vector<ServedModel> ReadModels(const google::protobuf::RepeatedPtrField<v1::Model>& models) {
  std::vector<ServedModel> result;
  for (const v1::Model& model : models) {
    ServedModel& read = result.emplace_back();
    read.name = model.name();
    read.version = model.version();
    read.method = MethodWord(model.method());
    read.joint_count = static_cast<int>(model.joint_count());
    read.parameter_count = static_cast<int64_t>(model.parameter_count());
    read.sample_count = static_cast<int64_t>(model.sample_count());
  }
  return result;
}

}  // namespace

absl::StatusOr<TransferAnswer> ReadTransferResponse(const v1::TransferResponse& response,
                                                    const TriangleMesh& source) {
  TransferAnswer answer;
  TransferResult& result = answer.result;
  absl::StatusOr<TriangleMesh> target = MeshFromWire(response.target(), kNoMeshLimits);
  if (!target.ok()) return BadAnswer("target", target.status());
  if (target->vertex_count() != source.vertex_count()) {
    return BadCount("target", target->vertex_count(), source.vertex_count());
  }
  result.target = source;
  result.target.positions = std::move(target->positions);
  result.target.normals = std::move(target->normals);

  Rig &source_rig = result.source_rig, &reference_rig = result.reference_rig;
  STANCE_RETURN_IF_ERROR(ReadSkeleton(response.source_skeleton(), "source_skeleton", &answer.joints,
                                      &source_rig.joints, &source_rig.confidence));
  STANCE_RETURN_IF_ERROR(ReadSkeleton(response.reference_skeleton(), "reference_skeleton", &answer.joints,
                                      &reference_rig.joints, &reference_rig.confidence));
  STANCE_RETURN_IF_ERROR(ReadSkeleton(response.target_skeleton(), "target_skeleton", &answer.joints,
                                      &result.target_joints, nullptr));
  if (response.has_weights()) {
    STANCE_RETURN_IF_ERROR(ReadWeights(response.weights(), "weights", &source_rig.weights));
    if (source_rig.weights.rows() != source.vertex_count()) {
      return BadCount("weights", source_rig.weights.rows(), source.vertex_count());
    }
  }
  if (response.has_reference_weights()) {
    STANCE_RETURN_IF_ERROR(
        ReadWeights(response.reference_weights(), "reference_weights", &reference_rig.weights));
  }
  absl::StatusOr<std::vector<AffineTransform>> transforms = TransformsFromWire(response.joint_transforms());
  if (!transforms.ok()) return BadAnswer("response", transforms.status());
  if (transforms->size() != answer.joints.parents.size()) {
    return BadCount("joint_transforms", transforms->size(), answer.joints.parents.size());
  }
  result.transforms = *std::move(transforms);
  if (response.has_confidence()) {
    if (!(response.confidence() >= 0 && response.confidence() <= 1)) {
      return absl::InternalError(
          fmt::format("the server's answer: confidence is {}, not in [0, 1]", response.confidence()));
    }
    result.confidence = response.confidence();
  }
  result.warnings.assign(response.warnings().begin(), response.warnings().end());
  result.seconds = PhasesFromWire(response.timings());
  answer.service = ReadServiceSeconds(response.timings());
  answer.result.model = response.model();
  answer.request_id = response.request_id();
  return answer;
}

absl::StatusOr<RigAnswer> ReadRigResponse(const v1::RigResponse& response, const TriangleMesh& mesh) {
  RigAnswer answer;
  Rig& rig = answer.result.rig;
  STANCE_RETURN_IF_ERROR(
      ReadSkeleton(response.skeleton(), "skeleton", &answer.joints, &rig.joints, &rig.confidence));
  STANCE_RETURN_IF_ERROR(ReadWeights(response.weights(), "weights", &rig.weights));
  if (rig.weights.rows() != mesh.vertex_count()) {
    return BadCount("weights", rig.weights.rows(), mesh.vertex_count());
  }
  answer.result.warnings.assign(response.warnings().begin(), response.warnings().end());
  answer.result.seconds = PhasesFromWire(response.timings());
  answer.service = ReadServiceSeconds(response.timings());
  answer.result.model = response.model();
  answer.request_id = response.request_id();
  return answer;
}

ServerInfo ReadServerInfo(const v1::GetServerInfoResponse& response) {
  ServerInfo info;
  info.version = response.version();
  info.models = ReadModels(response.models());
  for (const int method : response.methods()) {
    info.methods.push_back(MethodWord(static_cast<v1::Method>(method)));
  }
  info.default_method = MethodWord(response.default_method());
  for (const int format : response.formats()) {
    info.formats.push_back(LowerSuffix(v1::MeshFormat_Name(static_cast<v1::MeshFormat>(format)), 12));
  }
  const v1::Limits& limits = response.limits();
  info.max_message_bytes = static_cast<int64_t>(limits.max_message_bytes());
  info.max_vertices = static_cast<int64_t>(limits.max_vertices());
  info.max_faces = static_cast<int64_t>(limits.max_faces());
  info.max_queued_requests = static_cast<int64_t>(limits.max_queued_requests());
  info.max_queued_bytes = static_cast<int64_t>(limits.max_queued_bytes());
  info.max_queued_vertices = static_cast<int64_t>(limits.max_queued_vertices());
  info.max_queued_requests_per_client = static_cast<int64_t>(limits.max_queued_requests_per_client());
  info.max_batch_requests = limits.max_batch_requests();
  info.max_batch_vertices = static_cast<int64_t>(limits.max_batch_vertices());
  info.max_stream_references = limits.max_stream_references();
  return info;
}

ReloadAnswer ReadReloadResponse(const v1::ReloadModelsResponse& response) {
  return {.switched = response.switched(), .models = ReadModels(response.models())};
}

}  // namespace stance
