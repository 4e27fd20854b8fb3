#include "server/metrics.h"

#include <fmt/format.h>
#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <array>
#include <mutex>
#include <sstream>
#include <utility>

#include "core/base/files.h"
#include "server/certificate.h"
#include "server/process_metrics.h"
#include "server/version.h"

namespace stance {
namespace {

constexpr std::array<const char*, 5> kRpcNames = {"Transfer", "Rig", "GetServerInfo", "ReloadModels",
                                                  "Animate"};
constexpr std::array<const char*, 3> kReloadNames = {"switched", "unchanged", "failed"};
constexpr std::array<const char*, 9> kPhaseNames = {"queue", "decode",  "check",  "resample", "network",
                                                    "pose",  "weights", "deform", "encode"};
constexpr int kCodes = 17;  // OK to UNAUTHENTICATED

// Bounds in seconds: a phase of a small mesh takes microseconds, a request of a million vertices tens of
// seconds.
const prometheus::Histogram::BucketBoundaries kSeconds = {0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01,
                                                          0.025,  0.05,    0.1,    0.25,  0.5,    0.75,  1,
                                                          1.5,    2.5,     5,      10,    25,     60};
const prometheus::Histogram::BucketBoundaries kCounts = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64};
const prometheus::Histogram::BucketBoundaries kVertices = {1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6, 3e6};

std::string CodeName(int code) {
  if (code == 0) return "OK";
  return absl::StatusCodeToString(static_cast<absl::StatusCode>(code));
}

}  // namespace

struct Metrics::Impl {
  std::vector<prometheus::MetricFamily> Collect() const {
    QueueGauges now;
    {
      std::lock_guard<std::mutex> guard(mutex);
      if (read_queue) now = read_queue();
      if (read_rig_cache) SetRigCache(read_rig_cache());
    }
    queued_requests->Set(static_cast<double>(now.queued_requests));
    queued_bytes->Set(static_cast<double>(now.queued_bytes));
    queued_vertices->Set(static_cast<double>(now.queued_vertices));
    queued_clients->Set(static_cast<double>(now.queued_clients));
    running_requests->Set(static_cast<double>(now.running_requests));
    if (!certificate_file.empty()) {
      // 0 for one that can't be read: expired long ago, as an alert should see it.
      const absl::StatusOr<std::string> chain = ReadFile(certificate_file);
      certificate_expiry->Set(chain.ok() ? CertificateExpiry(*chain).value_or(0) : 0);
    }
    std::vector<prometheus::MetricFamily> families = registry.Collect();
    for (prometheus::MetricFamily& family : ProcessMetrics()) families.push_back(std::move(family));
    return families;
  }

  // The counters run behind the cache's own. REQUIRES: mutex is held.
  void SetRigCache(const RigCache::Stats& now) const {
    rig_cache_hits->Increment(static_cast<double>(now.hits) - rig_cache_hits->Value());
    rig_cache_misses->Increment(static_cast<double>(now.misses) - rig_cache_misses->Value());
    rig_cache_evictions->Increment(static_cast<double>(now.evictions) - rig_cache_evictions->Value());
    rig_cache_entries->Set(static_cast<double>(now.entries));
    rig_cache_bytes->Set(static_cast<double>(now.bytes));
  }

  prometheus::Registry registry;
  std::array<std::array<prometheus::Counter*, kCodes>, kRpcNames.size()> requests;
  std::array<prometheus::Histogram*, kRpcNames.size()> request_seconds;
  std::array<prometheus::Histogram*, kPhaseNames.size()> phase_seconds;
  prometheus::Histogram* batch_requests;
  prometheus::Histogram* batch_vertices;
  prometheus::Family<prometheus::Counter>* rejections;
  prometheus::Counter* abandoned;
  prometheus::Family<prometheus::Counter>* token_reloads;
  prometheus::Family<prometheus::Gauge>* token_reload_success;
  std::array<prometheus::Counter*, kReloadNames.size()> model_reloads;
  prometheus::Gauge* model_reload_success;
  prometheus::Family<prometheus::Gauge>* models;
  std::vector<prometheus::Gauge*> loaded;  // of `models`; protected by mutex
  std::string certificate_file;
  prometheus::Gauge* certificate_expiry = nullptr;
  prometheus::Counter* late_starts;
  prometheus::Gauge* queued_requests;
  prometheus::Gauge* queued_bytes;
  prometheus::Gauge* queued_vertices;
  prometheus::Gauge* queued_clients;
  prometheus::Gauge* running_requests;
  prometheus::Counter* rig_cache_hits;
  prometheus::Counter* rig_cache_misses;
  prometheus::Counter* rig_cache_evictions;
  prometheus::Gauge* rig_cache_entries;
  prometheus::Gauge* rig_cache_bytes;
  mutable std::mutex mutex;
  std::function<QueueGauges()> read_queue;  // protected by mutex, as is the next
  std::function<RigCache::Stats()> read_rig_cache;
};

Metrics::Metrics() : impl_(std::make_unique<Impl>()) {
  prometheus::Registry& registry = impl_->registry;
  const auto counter = [&](const char* name, const char* help) -> prometheus::Family<prometheus::Counter>& {
    return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
  };
  const auto histogram = [&](const char* name,
                             const char* help) -> prometheus::Family<prometheus::Histogram>& {
    return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
  };
  const auto gauge = [&](const char* name, const char* help) {
    return &prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
  };
  auto& requests = counter("stance_requests_total", "Requests answered, by RPC and code");
  auto& seconds = histogram("stance_request_seconds", "From a request's arrival to its answer, seconds");
  for (size_t rpc = 0; rpc < kRpcNames.size(); ++rpc) {
    for (int code = 0; code < kCodes; ++code) {
      impl_->requests[rpc][static_cast<size_t>(code)] =
          &requests.Add({{"rpc", kRpcNames[rpc]}, {"code", CodeName(code)}});
    }
    impl_->request_seconds[rpc] = &seconds.Add({{"rpc", kRpcNames[rpc]}}, kSeconds);
  }
  auto& phases = histogram("stance_phase_seconds", "Time of a request in each phase, seconds");
  for (size_t phase = 0; phase < kPhaseNames.size(); ++phase) {
    impl_->phase_seconds[phase] = &phases.Add({{"phase", kPhaseNames[phase]}}, kSeconds);
  }
  impl_->batch_requests = &histogram("stance_batch_requests", "Requests in a batch").Add({}, kCounts);
  impl_->batch_vertices = &histogram("stance_batch_vertices", "Vertices in a batch").Add({}, kVertices);
  impl_->rejections = &counter("stance_rejections_total", "Requests that were not run, by reason");
  impl_->abandoned = &counter("stance_abandoned_requests_total", "Requests given up while they ran").Add({});
  impl_->late_starts =
      &counter("stance_late_starts_total", "Requests that began to run after their deadline").Add({});
  impl_->queued_requests = gauge("stance_queued_requests", "Requests waiting for a worker");
  impl_->queued_bytes = gauge("stance_queued_bytes", "Bytes of requests waiting for a worker");
  impl_->queued_vertices = gauge("stance_queued_vertices", "Vertices of requests waiting for a worker");
  impl_->queued_clients = gauge("stance_queued_clients", "Clients with requests waiting for a worker");
  impl_->running_requests = gauge("stance_running_requests", "Requests being run");
  impl_->rig_cache_hits =
      &counter("stance_rig_cache_hits_total", "Meshes whose rig was in the cache").Add({});
  impl_->rig_cache_misses =
      &counter("stance_rig_cache_misses_total", "Meshes whose rig was not in the cache").Add({});
  impl_->rig_cache_evictions =
      &counter("stance_rig_cache_evictions_total", "Rigs that left the cache for want of room").Add({});
  impl_->rig_cache_entries = gauge("stance_rig_cache_entries", "Rigs in the cache");
  impl_->rig_cache_bytes = gauge("stance_rig_cache_bytes", "Bytes of the rigs in the cache");
  impl_->token_reloads =
      &counter("stance_token_reloads_total", "Readings of a changed token file, by result");
  impl_->token_reload_success = &prometheus::BuildGauge()
                                     .Name("stance_token_reload_success")
                                     .Help("Whether the token file was accepted when it was last read")
                                     .Register(registry);
  auto& model_reloads = counter("stance_model_reloads_total", "Reloads of the models, by result");
  for (size_t result = 0; result < kReloadNames.size(); ++result) {
    impl_->model_reloads[result] = &model_reloads.Add({{"result", kReloadNames[result]}});
  }
  impl_->model_reload_success = gauge("stance_model_reload_success", "Whether the last reload did not fail");
  impl_->model_reload_success->Set(1);
  impl_->models = &prometheus::BuildGauge()
                       .Name("stance_model_info")
                       .Help("1 for each loaded model, with its name, version and method")
                       .Register(registry);
  prometheus::BuildGauge()
      .Name("stance_build_info")
      .Help("1, with the server's version")
      .Register(registry)
      .Add({{"version", kVersion}})
      .Set(1);
}

Metrics::~Metrics() = default;

void Metrics::ObserveRequest(Rpc rpc, absl::StatusCode code, double seconds) {
  const auto row = static_cast<size_t>(rpc);
  const int column = static_cast<int>(code);
  impl_->requests[row][static_cast<size_t>(column < kCodes ? column : 2)]->Increment();
  impl_->request_seconds[row]->Observe(seconds);
}

void Metrics::ObservePhase(Phase phase, double seconds) {
  impl_->phase_seconds[static_cast<size_t>(phase)]->Observe(seconds);
}

void Metrics::ObserveBatch(int64_t requests, int64_t vertices) {
  impl_->batch_requests->Observe(static_cast<double>(requests));
  impl_->batch_vertices->Observe(static_cast<double>(vertices));
}

void Metrics::CountRejection(const std::string& reason) {
  impl_->rejections->Add({{"reason", reason}}).Increment();
}

void Metrics::CountAbandoned() { impl_->abandoned->Increment(); }

void Metrics::CountLateStart() { impl_->late_starts->Increment(); }

void Metrics::CountTokenReload(bool accepted) {
  for (const char* result : {"accepted", "refused"}) {
    impl_->token_reloads->Add({{"result", result}}).Increment((result[0] == 'a') == accepted ? 1 : 0);
  }
  impl_->token_reload_success->Add({}).Set(accepted ? 1 : 0);
}

void Metrics::CountModelReload(ModelReload result) {
  impl_->model_reloads[static_cast<size_t>(result)]->Increment();
  impl_->model_reload_success->Set(result == ModelReload::kFailed ? 0 : 1);
}

void Metrics::SetModels(const std::vector<ModelLabels>& models) {
  std::lock_guard<std::mutex> guard(impl_->mutex);
  for (prometheus::Gauge* gauge : std::exchange(impl_->loaded, {})) impl_->models->Remove(gauge);
  for (const ModelLabels& model : models) {
    impl_->loaded.push_back(
        &impl_->models->Add({{"name", model.name}, {"version", model.version}, {"method", model.method}}));
    impl_->loaded.back()->Set(1);
  }
}

void Metrics::SetCertificateFile(const std::string& path) {
  impl_->certificate_file = path;
  impl_->certificate_expiry = &prometheus::BuildGauge()
                                   .Name("stance_tls_certificate_expiry_seconds")
                                   .Help("When the server's certificate file expires, seconds since 1970")
                                   .Register(impl_->registry)
                                   .Add({});
}

void Metrics::SetQueueSource(std::function<QueueGauges()> read) {
  std::lock_guard<std::mutex> guard(impl_->mutex);
  impl_->read_queue = std::move(read);
}

void Metrics::SetRigCacheSource(std::function<RigCache::Stats()> read) {
  std::lock_guard<std::mutex> guard(impl_->mutex);
  impl_->read_rig_cache = std::move(read);
}

std::string Metrics::Page() const { return prometheus::TextSerializer().Serialize(impl_->Collect()); }

absl::StatusOr<int> Metrics::Serve(const std::string& address) {
  STANCE_ASSIGN_OR_RETURN(page_, MetricsPage::Serve(address, [this] { return Page(); }));
  return page_->port();
}

}  // namespace stance
