#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/input.h"
#include "client/client.h"
#include "core/mesh/mesh_io.h"

namespace stance {
namespace {

void Print(const nlohmann::ordered_json& json) {
  const std::string text = json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  std::fputs(text.c_str(), stdout);
}

template <typename... Args>
void Print(fmt::format_string<Args...> format, Args&&... args) {
  std::fputs(fmt::format(format, std::forward<Args>(args)...).c_str(), stdout);
}

nlohmann::ordered_json JsonOf(const std::vector<ServedModel>& models) {
  nlohmann::ordered_json array = nlohmann::ordered_json::array();
  for (const ServedModel& model : models) {
    array.push_back({{"name", model.name},
                     {"version", model.version},
                     {"method", model.method},
                     {"joint_count", model.joint_count},
                     {"parameter_count", model.parameter_count},
                     {"sample_count", model.sample_count}});
  }
  return array;
}

void Print(const std::vector<ServedModel>& models) {
  for (const ServedModel& model : models) {
    Print("model       {} {}: method {}, {} joints, {} parameters, {} samples\n", model.name, model.version,
          model.method, model.joint_count, model.parameter_count, model.sample_count);
  }
}

std::vector<float> Row(const Eigen::RowVector3f& row) { return {row.data(), row.data() + 3}; }

}  // namespace

absl::Status RunInfo(const InfoArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh mesh, ReadInput(arguments.mesh));
  STANCE_ASSIGN_OR_RETURN(const MeshReport report, CheckInput(arguments.mesh, mesh));
  STANCE_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatFromName(arguments.mesh));
  const Eigen::RowVector3f low = mesh.positions.colwise().minCoeff();
  const Eigen::RowVector3f high = mesh.positions.colwise().maxCoeff();
  if (arguments.json) {
    nlohmann::ordered_json groups = nlohmann::ordered_json::array();
    for (const MeshGroup& group : mesh.groups) {
      groups.push_back(
          {{"name", group.name}, {"first_face", group.first_face}, {"face_count", group.face_count}});
    }
    Print({{"file", arguments.mesh},
           {"format", std::string(MeshFormatName(format))},
           {"vertices", mesh.vertex_count()},
           {"faces", mesh.face_count()},
           {"bounds", {{"min", Row(low)}, {"max", Row(high)}}},
           {"normals", mesh.normals.rows() > 0},
           {"texcoords", mesh.texcoords.rows() > 0},
           {"groups", groups},
           {"components", report.components},
           {"degenerate_faces", report.degenerate_faces},
           {"unreferenced_vertices", report.unreferenced_vertices},
           {"non_manifold_edges", report.non_manifold_edges},
           {"warnings", report.warnings}});
    return absl::OkStatus();
  }
  Print("file        {} ({})\n", arguments.mesh, std::string(MeshFormatName(format)));
  Print("vertices    {}\nfaces       {}\n", mesh.vertex_count(), mesh.face_count());
  Print("bounds      [{:.4g}, {:.4g}, {:.4g}] to [{:.4g}, {:.4g}, {:.4g}]\n", low.x(), low.y(), low.z(),
        high.x(), high.y(), high.z());
  Print("attributes  {}{}{} groups\n", mesh.normals.rows() > 0 ? "normals, " : "",
        mesh.texcoords.rows() > 0 ? "texture coordinates, " : "", mesh.groups.size());
  Print("components  {}\n", report.components);
  for (const std::string& warning : report.warnings) Print("warning: {}\n", warning);
  return absl::OkStatus();
}

absl::Status RunServerInfo(const ServerInfoArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const ClientOptions options, ClientOptionsOf(arguments.backend));
  STANCE_ASSIGN_OR_RETURN(const std::unique_ptr<StanceClient> client, StanceClient::Connect(options));
  CallOptions call;
  call.timeout = std::chrono::duration<double>(arguments.backend.timeout);
  const absl::StatusOr<ServerInfo> answer = client->GetServerInfo(call);
  if (!answer.ok()) return ServerError(answer.status());
  const ServerInfo& info = *answer;
  if (arguments.json) {
    Print({{"server", arguments.backend.server},
           {"version", info.version},
           {"models", JsonOf(info.models)},
           {"default_method", info.default_method},
           {"methods", info.methods},
           {"formats", info.formats},
           {"limits",
            {{"max_message_bytes", info.max_message_bytes},
             {"max_vertices", info.max_vertices},
             {"max_faces", info.max_faces},
             {"max_queued_requests", info.max_queued_requests},
             {"max_queued_bytes", info.max_queued_bytes},
             {"max_queued_vertices", info.max_queued_vertices},
             {"max_queued_requests_per_client", info.max_queued_requests_per_client},
             {"max_batch_requests", info.max_batch_requests},
             {"max_batch_vertices", info.max_batch_vertices},
             {"max_stream_references", info.max_stream_references}}}});
    return absl::OkStatus();
  }
  Print("server      {}\nversion     {}\n", arguments.backend.server, info.version);
  Print(info.models);
  Print("methods     {}; default {}\nformats     {}\n", fmt::join(info.methods, " "), info.default_method,
        fmt::join(info.formats, " "));
  Print("message     at most {} bytes\nmesh        at most {} vertices, {} faces\n", info.max_message_bytes,
        info.max_vertices, info.max_faces);
  Print("queue       at most {} requests, {} bytes, {} vertices\n", info.max_queued_requests,
        info.max_queued_bytes, info.max_queued_vertices);
  if (info.max_queued_requests_per_client > 0) {
    Print("client      at most {} requests in the queue\n", info.max_queued_requests_per_client);
  }
  Print("batch       at most {} requests, {} vertices\n", info.max_batch_requests, info.max_batch_vertices);
  Print("animate     at most {} references in flight\n", info.max_stream_references);
  return absl::OkStatus();
}

absl::Status RunReload(const ReloadArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const ClientOptions options, ClientOptionsOf(arguments.backend));
  STANCE_ASSIGN_OR_RETURN(const std::unique_ptr<StanceClient> client, StanceClient::Connect(options));
  CallOptions call;
  call.timeout = std::chrono::duration<double>(arguments.backend.timeout);
  const absl::StatusOr<ReloadAnswer> answer = client->ReloadModels(call);
  if (!answer.ok()) return ServerError(answer.status());
  if (arguments.json) {
    Print({{"server", arguments.backend.server},
           {"switched", answer->switched},
           {"models", JsonOf(answer->models)}});
    return absl::OkStatus();
  }
  Print("{}\n", answer->switched ? "reloaded" : "unchanged");
  Print(answer->models);
  return absl::OkStatus();
}

}  // namespace stance
