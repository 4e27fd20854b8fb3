// What operators measure. Names and labels stand in docs/operations.md.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/transfer/rig_cache.h"
#include "server/metrics_page.h"

namespace stance {

// One RPC method, as a label.
enum class Rpc { kTransfer, kRig, kGetServerInfo, kReloadModels, kAnimate };

// Where the time of a request goes.
enum class Phase { kQueue, kDecode, kCheck, kResample, kNetwork, kPose, kWeights, kDeform, kEncode };

// How a reload of the models ended.
enum class ModelReload { kSwitched, kUnchanged, kFailed };

// A loaded model.
struct ModelLabels {
  std::string name;
  std::string version;
  std::string method;
};

// The queue as it stands; read at each scrape.
struct QueueGauges {
  int64_t queued_requests = 0;
  int64_t queued_bytes = 0;
  int64_t queued_vertices = 0;
  int64_t queued_clients = 0;
  int64_t running_requests = 0;
};

// Counters, histograms (in seconds) and their page. Thread-safe; an observation costs tens of nanoseconds, as
// every label combination's handle is made beforehand.
class Metrics {
 public:
  Metrics();
  ~Metrics();

  void ObserveRequest(Rpc rpc, absl::StatusCode code, double seconds);
  void ObservePhase(Phase phase, double seconds);
  void ObserveBatch(int64_t requests, int64_t vertices);
  // A request that was not run, by the ErrorInfo reason.
  void CountRejection(const std::string& reason);
  // A request that was given up while it ran.
  void CountAbandoned();
  // A request that started to run after its deadline: stays 0.
  void CountLateStart();

  // A reading of the token file, at the start too; false if it was refused.
  void CountTokenReload(bool accepted);

  void CountModelReload(ModelReload result);

  // The models that are loaded now, in place of those before.
  void SetModels(const std::vector<ModelLabels>& models);
  // The file of the server's certificate, read at each scrape for its expiry. To be called before the first
  // page.
  void SetCertificateFile(const std::string& path);

  // Where the queue's gauges come from; nullptr: they are 0. `read` is called from the scraping thread.
  void SetQueueSource(std::function<QueueGauges()> read);

  // The same for the rig cache.
  void SetRigCacheSource(std::function<RigCache::Stats()> read);

  // The page in Prometheus's text format.
  std::string Page() const;

  // Serves the page on http://HOST:PORT/metrics from now on and returns the port. Errors as
  // MetricsPage::Serve.
  absl::StatusOr<int> Serve(const std::string& address);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::unique_ptr<MetricsPage> page_;  // destroyed first: it reads impl_
};

}  // namespace stance
