#include "server/server.h"

#include <fmt/format.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <future>
#include <initializer_list>
#include <mutex>
#include <thread>
#include <vector>

#include "core/transfer/rig_cache.h"
#include "proto/wire/mesh_wire.h"
#include "server/admin_service.h"
#include "server/animate_stream.h"
#include "server/log.h"
#include "server/model_repository.h"
#include "server/model_source.h"
#include "server/pose_transfer_calls.h"
#include "server/services.h"
#include "server/tls.h"
#include "server/token_file.h"
#include "server/version.h"

namespace stance {
namespace {

// Health watchers are open-ended streams; this long after the last call has finished they are cut.
constexpr std::chrono::milliseconds kWatcherGrace(200);

Duration Seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

// The address with its port replaced: the one that was bound.
std::string WithPort(const std::string& address, int port) {
  return fmt::format("{}:{}", address.substr(0, address.rfind(':')), port);
}

absl::Status Prefixed(const char* option, const absl::Status& status) {
  return absl::Status(status.code(), option + std::string(status.message()));
}

const char* TlsMode(const ServerConfig& config) {
  if (config.tls_certificate.empty()) return "off";
  return config.tls_client_ca.empty() ? "on" : "mutual";
}

BatcherOptions BatchingOf(const ServerConfig& config) {
  return {.workers = static_cast<int>(config.inference_workers),
          .max_batch_items = static_cast<int>(config.batching_max_batch_requests),
          .max_batch_cost = config.batching_max_batch_vertices,
          .max_queued_items = config.batching_max_queued_requests,
          .max_queued_bytes = config.batching_max_queued_bytes,
          .max_queued_cost = config.batching_max_queued_vertices,
          .max_queued_items_per_client = config.batching_max_queued_requests_per_client,
          .priority_aging = Seconds(config.batching_priority_aging_seconds),
          .refuse_unmeetable = config.batching_refuse_unmeetable};
}

// Without the models.
v1::GetServerInfoResponse InfoOf(const ServerConfig& config) {
  v1::GetServerInfoResponse info;
  info.set_version(kVersion);
  for (MeshFormat format :
       {MeshFormat::kObj, MeshFormat::kPly, MeshFormat::kOff, MeshFormat::kStl, MeshFormat::kGlb}) {
    info.add_formats(MeshFormatToWire(format));
  }
  v1::Limits* limits = info.mutable_limits();
  limits->set_max_message_bytes(static_cast<uint64_t>(config.server_max_message_bytes));
  limits->set_max_vertices(static_cast<uint64_t>(config.limits_max_vertices));
  limits->set_max_faces(static_cast<uint64_t>(config.limits_max_faces));
  limits->set_max_queued_requests(static_cast<uint64_t>(config.batching_max_queued_requests));
  limits->set_max_queued_bytes(static_cast<uint64_t>(config.batching_max_queued_bytes));
  limits->set_max_queued_vertices(static_cast<uint64_t>(config.batching_max_queued_vertices));
  limits->set_max_queued_requests_per_client(
      static_cast<uint64_t>(config.batching_max_queued_requests_per_client));
  limits->set_max_stream_references(AnimateStream::kMostReferences);
  limits->set_max_batch_requests(static_cast<uint32_t>(config.batching_max_batch_requests));
  limits->set_max_batch_vertices(static_cast<uint64_t>(config.batching_max_batch_vertices));
  return info;
}

class AssembledServer : public Server {
 public:
  // `rig_cache`: the pipelines'; null if they have none.
  AssembledServer(const ServerConfig& config, std::unique_ptr<ModelSource> source, LoadedModels first,
                  const std::shared_ptr<RigCache>& rig_cache)
      : config_(config),
        catalog_{first.pipeline->models(),
                 first.pipeline->skeleton(),
                 {config.limits_max_vertices, config.limits_max_faces}},
        models_(std::move(source), std::move(first), metrics_),
        runner_(
            BatchingOf(config),
            [this](std::span<CallRunner::Item> batch) {
              // Held until the batch is done, whatever is loaded meanwhile.
              const std::shared_ptr<const Pipeline> pipeline = models_.current();
              RunCalls(*pipeline, metrics_, RealClock(), batch);
            },
            RealClock(), [this] { WarmUp(); }),
        serving_{metrics_, runner_, RealClock(), active_,
                 streams_, gate_,   costs_,      config.batching_client_metadata},
        pose_transfer_(serving_, catalog_),
        server_info_(InfoOf(config), models_, serving_),
        admin_(models_, gate_, metrics_) {
    if (!config_.tls_certificate.empty()) {
      metrics_.SetCertificateFile(config_.tls_certificate);
    }
    if (rig_cache != nullptr) {
      metrics_.SetRigCacheSource([rig_cache] { return rig_cache->stats(); });
    }
    metrics_.SetQueueSource([this] {
      const CallRunner::Stats stats = runner_.stats();
      return QueueGauges{.queued_requests = stats.queued_items,
                         .queued_bytes = stats.queued_bytes,
                         .queued_vertices = stats.queued_cost,
                         .queued_clients = stats.queued_clients,
                         .running_requests = stats.running_items};
    });
  }

  ~AssembledServer() override {
    if (server_ != nullptr) Drain();
    CloseAdmin();
    metrics_.SetQueueSource(nullptr);
  }

  absl::Status Listen() {
    if (!warm_up_.ok()) return Prefixed("model.directory: ", warm_up_);
    STANCE_ASSIGN_OR_RETURN(const std::shared_ptr<grpc::ServerCredentials> credentials,
                            MakeServerCredentials(config_));
    STANCE_RETURN_IF_ERROR(OpenTokens());
    if (!config_.metrics_listen.empty()) {
      const absl::StatusOr<int> port = metrics_.Serve(config_.metrics_listen);
      if (!port.ok()) return Prefixed("metrics.listen: ", port.status());
      metrics_address_ = WithPort(config_.metrics_listen, *port);
    }
    grpc::EnableDefaultHealthCheckService(true);
    if (config_.server_reflection) grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    // First, as nothing is accepted yet that would have to be finished if the other can't be bound.
    if (!config_.admin_listen.empty()) {
      STANCE_ASSIGN_OR_RETURN(
          admin_server_, Bind("admin.listen", config_.admin_listen, credentials, {&admin_}, &admin_address_));
    }
    STANCE_ASSIGN_OR_RETURN(server_, Bind("server.listen", config_.server_listen, credentials,
                                          {&pose_transfer_, &server_info_}, &address_));
    SetServing(true);
    return absl::OkStatus();
  }

  void Reload() override {
    if (tokens_ != nullptr) tokens_->Reload();
    models_.Reload([](const absl::StatusOr<bool>&) {});  // it has logged what came of it
  }

  std::string address() const override { return address_; }
  std::string metrics_address() const override { return metrics_address_; }
  std::string admin_address() const override { return admin_address_; }

  bool Drain() override {
    SetServing(false);
    std::this_thread::sleep_for(Seconds(config_.server_lame_duck_seconds));
    const TimePoint deadline = RealClock().Now() + Seconds(config_.server_drain_timeout_seconds);
    streams_.Drain();
    const bool complete = runner_.Drain(deadline);
    // Every call now has its answer; what is left is to send them. Only then is the transport closed, as
    // closing it gives no more than its own deadline to every stream, health watchers included.
    active_.Close();
    const bool sent = active_.AwaitNone(std::max(deadline, RealClock().Now() + kWatcherGrace));
    server_->Shutdown(std::chrono::system_clock::now() + kWatcherGrace);
    server_.reset();
    CloseAdmin();
    return complete && sent;
  }

 private:
  absl::Status OpenTokens() {
    if (config_.auth_token_file.empty()) return absl::OkStatus();
    absl::StatusOr<std::unique_ptr<TokenFile>> tokens =
        TokenFile::Open(config_.auth_token_file, gate_, metrics_);
    if (!tokens.ok()) return Prefixed("auth.token_file: ", tokens.status());
    tokens_ = *std::move(tokens);
    if (config_.tls_certificate.empty()) {
      Log(LogLevel::kWarn, "tokens without TLS", {{"address", config_.server_listen}});
    }
    return absl::OkStatus();
  }

  // On each worker, before it takes requests.
  void WarmUp() {
    const absl::Status status = models_.current()->WarmUp();
    const std::lock_guard<std::mutex> guard(warm_up_mutex_);
    warm_up_.Update(status);
  }

  absl::StatusOr<std::unique_ptr<grpc::Server>> Bind(
      const char* option, const std::string& listen,
      const std::shared_ptr<grpc::ServerCredentials>& credentials,
      std::initializer_list<grpc::Service*> services, std::string* address) const {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort(listen, credentials, &port);
    for (grpc::Service* service : services) builder.RegisterService(service);
    Configure(builder);
    std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
    if (server == nullptr || port == 0) {
      return absl::UnavailableError(fmt::format("{}: {} can't be bound", option, listen));
    }
    *address = WithPort(listen, port);
    return server;
  }

  void CloseAdmin() {
    models_.Close();  // gives every call its answer
    if (admin_server_ != nullptr) admin_server_->Shutdown(std::chrono::system_clock::now() + kWatcherGrace);
    admin_server_.reset();
  }

  void Configure(grpc::ServerBuilder& builder) const {
    const auto milliseconds = [](double seconds) { return static_cast<int>(seconds * 1000); };
    builder.SetMaxReceiveMessageSize(static_cast<int>(config_.server_max_message_bytes));
    builder.SetMaxSendMessageSize(static_cast<int>(config_.server_max_message_bytes));
    grpc::ResourceQuota quota("stance");
    quota.Resize(static_cast<size_t>(config_.server_memory_quota_bytes));
    builder.SetResourceQuota(quota);
    // A second server on the same port would take half of the connections without anyone noticing.
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, milliseconds(config_.server_keepalive_seconds));
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
    // Clients may ping as often as this server does, with calls or without.
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
    if (config_.server_max_connection_age_seconds > 0) {
      builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS,
                                 milliseconds(config_.server_max_connection_age_seconds));
    }
  }

  void SetServing(bool serving) {
    grpc::HealthCheckServiceInterface* health = server_->GetHealthCheckService();
    for (const char* service :
         {"", v1::PoseTransferService::service_full_name(), v1::ServerInfoService::service_full_name()}) {
      health->SetServingStatus(service, serving);
    }
  }

  const ServerConfig config_;
  std::mutex warm_up_mutex_;
  absl::Status warm_up_;   // the first failure; protected by warm_up_mutex_ while the workers start
  const Catalog catalog_;  // of the first models; the repository keeps names and methods
  Metrics metrics_;
  ModelRepository models_;
  ActiveCalls active_;
  OpenStreams streams_;
  CostEstimator costs_;
  TokenGate gate_;
  std::unique_ptr<TokenFile> tokens_;
  CallRunner runner_;
  const Serving serving_;
  PoseTransferServiceImpl pose_transfer_;
  ServerInfoServiceImpl server_info_;
  AdminServiceImpl admin_;
  std::unique_ptr<grpc::Server> admin_server_;
  std::unique_ptr<grpc::Server> server_;  // destroyed first: its calls use everything above
  std::string address_;
  std::string admin_address_;
  std::string metrics_address_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerConfig& config) {
  std::shared_ptr<RigCache> rig_cache;
  if (config.inference_rig_cache_bytes > 0) {
    rig_cache = std::make_shared<RigCache>(config.inference_rig_cache_bytes);
  }
  std::unique_ptr<ModelSource> source = MakeFolderSource(config, rig_cache);
  // On a thread that ends with it: a thread that has run a network keeps OpenMP's team.
  absl::StatusOr<LoadedModels> first = std::async(std::launch::async, [&] { return source->Load(""); }).get();
  if (!first.ok()) return Prefixed("model.directory: ", first.status());
  std::vector<std::string> models;
  for (const ModelInfo& model : first->pipeline->models()) models.push_back(model.name);
  auto server = std::make_unique<AssembledServer>(config, std::move(source), *std::move(first), rig_cache);
  STANCE_RETURN_IF_ERROR(server->Listen());
  Log(LogLevel::kInfo, "serving",
      {{"address", server->address()},
       {"metrics", server->metrics_address()},
       {"admin", server->admin_address()},
       {"tls", std::string(TlsMode(config))},
       {"version", std::string(kVersion)},
       {"models", fmt::format("{}", fmt::join(models, ", "))},
       {"workers", config.inference_workers},
       {"threads", config.inference_threads}});
  return std::unique_ptr<Server>(std::move(server));
}

}  // namespace stance
