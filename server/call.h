// One request from its arrival to its answer.
#pragma once

#include <grpcpp/server_context.h>

#include <atomic>
#include <memory>
#include <string>

#include "core/base/clock.h"
#include "core/transfer/parts.h"
#include "server/access/token_gate.h"
#include "server/active_calls.h"
#include "server/batching/batch_runner.h"
#include "server/batching/cost_estimator.h"
#include "server/metrics.h"
#include "server/open_streams.h"
#include "server/trace_context.h"

namespace stance {

class Call;
using CallRunner = BatchRunner<Call*>;

// What every call needs; it and what it refers to outlive every call and are thread-safe.
struct Serving {
  Metrics& metrics;
  CallRunner& runner;
  Clock& clock;
  ActiveCalls& active;
  OpenStreams& streams;
  TokenGate& gate;
  CostEstimator& costs;
  // The metadata key that names the caller; empty: the peer's host does.
  std::string client_metadata;
};

// What a worker makes of a call; calls of one kind share a batch.
enum class Work { kTransfer, kRig, kRigSource };

// Seconds of one request in the server's own phases.
struct ServerSeconds {
  double queue = 0;
  double decode = 0;
  double encode = 0;
  double total = 0;
};

// Begin queues it on a gRPC thread without waiting, a worker runs it in a batch, and it is answered exactly
// once. A cancellation, by the client or by the deadline, takes it out of the queue at once; if it runs
// already, its answer is not written.
class Call {
 public:
  virtual ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  // Plans and queues the call, or answers it with an error.
  void Begin();
  // Gives it up: at once, or at the next SweepCancelled of the runner.
  void Cancel();
  void MarkCancelled() { cancelled_->store(true); }

  // For the worker:
  Work work() const { return work_; }
  TimePoint deadline() const { return deadline_; }
  bool is_cancelled() const { return cancelled_->load(); }
  // What the work came to. To be set before the item is completed.
  void set_result(absl::Status result) { result_ = std::move(result); }
  ServerSeconds& seconds() { return seconds_; }
  // Tells the estimator what the call took, without its own wait.
  void LearnCost(const PhaseSeconds& core);

 protected:
  Call(const Serving& serving, Rpc rpc, Work work, grpc::CallbackServerContext* context);

  Rpc rpc() const { return rpc_; }
  const std::string& request_id() const { return request_id_; }
  const TraceContext& span() const { return span_; }

  // Checks everything but the meshes' content, in constant time; errors as in status_map.h.
  virtual absl::Status Plan() = 0;
  // The caller's own id, and where the answer's goes.
  virtual const std::string& RequestedId() const = 0;
  virtual int64_t Vertices() const = 0;
  virtual int64_t RequestBytes() const = 0;
  virtual Priority RequestedPriority() const = 0;
  // Calls of one kind cost alike. As the above, known once Plan has passed.
  virtual int CostKind() const = 0;
  // Before an answer without error is sent.
  virtual void FinishResponse(const std::string& request_id, const ServerSeconds& seconds) = 0;
  // Sends the answer. May delete this object.
  virtual void Send(const absl::Status& status) = 0;

 private:
  absl::Status Prepare();
  std::string Client() const;
  absl::Status StatusFor(Outcome outcome, Duration retry_after);
  // Logs, counts and sends the answer. Nothing of this object may be touched afterwards.
  void Answer(absl::Status status);

  const Serving& serving_;
  const Rpc rpc_;
  const Work work_;
  grpc::CallbackServerContext* const context_;
  const TimePoint arrival_;
  const TimePoint deadline_;
  const TraceContext span_;
  const bool counted_;  // in serving_.active; if not, the server is closing and the call is refused
  // Shared with the queue's item.
  const std::shared_ptr<std::atomic<bool>> cancelled_ = std::make_shared<std::atomic<bool>>(false);
  std::string request_id_;
  std::string client_;  // empty if it is not known
  absl::Status result_;
  ServerSeconds seconds_;
};

}  // namespace stance
