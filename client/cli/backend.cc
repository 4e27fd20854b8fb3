#include "client/cli/backend.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "client/cli/exit_code.h"
#include "client/client.h"
#include "core/base/threads.h"

namespace stance {
namespace {

class RemoteBackend : public Backend {
 public:
  RemoteBackend(std::unique_ptr<StanceClient> client, const BackendArguments& arguments)
      : client_(std::move(client)) {
    call_.timeout = std::chrono::duration<double>(arguments.timeout);
    if (!arguments.models.empty()) call_.model = arguments.models.front();
    // As OpenTelemetry's command line tools hand their span on.
    if (const char* traceparent = std::getenv("TRACEPARENT")) call_.traceparent = traceparent;
  }

  absl::StatusOr<TransferAnswer> Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                          const TransferOptions& options, bool want_weights) override {
    CallOptions call = call_;
    call.want_weights = want_weights;
    auto answer = client_->Transfer(source, reference, options, call);
    if (!answer.ok()) return ServerError(answer.status());
    return answer;
  }

  absl::Status Animate(const TriangleMesh& source, const TransferOptions& options, const NextReference& next,
                       const TakeAnswer& take) override {
    const auto take_named = [&](absl::StatusOr<TransferAnswer> answer) {
      if (!answer.ok()) return take(ServerError(answer.status()));
      take(std::move(answer));
    };
    return ServerError(client_->Animate(source, next, take_named, options, call_));
  }

  absl::StatusOr<RigAnswer> Rig(const TriangleMesh& mesh, const TransferOptions& options) override {
    auto answer = client_->Rig(mesh, options, call_);
    if (!answer.ok()) return ServerError(answer.status());
    return answer;
  }

 private:
  const std::unique_ptr<StanceClient> client_;
  CallOptions call_;
};

class LocalBackend : public Backend {
 public:
  explicit LocalBackend(std::unique_ptr<Pipeline> pipeline) : pipeline_(std::move(pipeline)) {}

  absl::StatusOr<TransferAnswer> Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                          const TransferOptions& options, bool want_weights) override {
    TransferAnswer answer;
    STANCE_ASSIGN_OR_RETURN(answer.result, pipeline_->Transfer(source, reference, options));
    if (!want_weights) answer.result.source_rig.weights.resize(0, 0);
    answer.joints = Joints();
    return answer;
  }

  absl::Status Animate(const TriangleMesh& source, const TransferOptions& options, const NextReference& next,
                       const TakeAnswer& take) override {
    const RigJob rig{&source, options};
    STANCE_ASSIGN_OR_RETURN(const RigSourceResult rigged, std::move(pipeline_->RigSources({&rig, 1})[0]));
    while (const std::optional<TriangleMesh> reference = next()) {
      const TransferJob job{&source, &*reference, options, {}, rigged.rigged};
      absl::StatusOr<TransferResult> result = std::move(pipeline_->TransferBatch({&job, 1})[0]);
      if (!result.ok()) {
        take(result.status());
        continue;
      }
      TransferAnswer answer;
      answer.result = *std::move(result);
      answer.joints = Joints();
      take(std::move(answer));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<RigAnswer> Rig(const TriangleMesh& mesh, const TransferOptions& options) override {
    RigAnswer answer;
    STANCE_ASSIGN_OR_RETURN(answer.result, pipeline_->RigMesh(mesh, options));
    answer.joints = Joints();
    return answer;
  }

 private:
  JointTree Joints() const { return {pipeline_->skeleton().names(), pipeline_->skeleton().parents()}; }

  const std::unique_ptr<Pipeline> pipeline_;
};

// The models of a source tree whose build/<preset>/bin holds this binary.
std::filesystem::path DefaultModels() {
  const char* dir = std::getenv("STANCE_MODEL_DIR");
  if (dir != nullptr && *dir != '\0') return dir;
  std::error_code error;
  const std::filesystem::path binary = std::filesystem::read_symlink("/proc/self/exe", error);
  return (binary.parent_path() / "../../../models").lexically_normal();
}

}  // namespace

absl::StatusOr<ClientOptions> ClientOptionsOf(const BackendArguments& arguments) {
  ClientOptions options;
  options.server = arguments.server;
  options.connect_timeout = std::chrono::duration<double>(std::min(5.0, arguments.timeout));
  STANCE_RETURN_IF_ERROR(ReadCredentials(arguments.credentials, &options));
  return options;
}

absl::StatusOr<std::unique_ptr<Backend>> MakeBackend(const BackendArguments& arguments) {
  if (arguments.local) {
    std::vector<std::filesystem::path> folders(arguments.models.begin(), arguments.models.end());
    if (folders.empty()) folders.push_back(DefaultModels());
    PipelineOptions options;
    options.threads = arguments.threads > 0 ? arguments.threads : CpuQuota();
    auto pipeline = Pipeline::Load(folders, options);
    if (!pipeline.ok()) return FileError(pipeline.status());
    return std::make_unique<LocalBackend>(*std::move(pipeline));
  }
  STANCE_ASSIGN_OR_RETURN(const ClientOptions options, ClientOptionsOf(arguments));
  STANCE_ASSIGN_OR_RETURN(std::unique_ptr<StanceClient> client, StanceClient::Connect(options));
  return std::make_unique<RemoteBackend>(std::move(client), arguments);
}

}  // namespace stance
