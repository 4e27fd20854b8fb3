#include "server/call.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "server/call_metadata.h"
#include "server/client_key.h"
#include "server/log.h"
#include "server/request_id.h"
#include "server/status_map.h"

namespace stance {
namespace {

using std::chrono::milliseconds;

// A full queue of ordinary meshes needs seconds to empty, but a place in it is free after one batch.
constexpr milliseconds kOverloadPushback(250);
// An expectation of a longer wait may be wrong, and the caller should not be lost over it.
constexpr milliseconds kMostPushback(30'000);

// gRPC speaks of deadlines in calendar time, the queue in steady time.
TimePoint SteadyDeadline(std::chrono::system_clock::time_point deadline, TimePoint now) {
  constexpr std::chrono::hours kFar(24 * 365);
  const auto left = deadline - std::chrono::system_clock::now();
  return left > kFar ? kNever : now + std::chrono::duration_cast<Duration>(left);
}

// When to come back, if that is expected to be worth while after `wait`.
milliseconds Pushback(Duration wait) {
  return std::clamp(std::chrono::ceil<milliseconds>(wait), kOverloadPushback, kMostPushback);
}

const char* RpcName(Rpc rpc) {
  switch (rpc) {
    case Rpc::kTransfer:
      return "Transfer";
    case Rpc::kRig:
      return "Rig";
    case Rpc::kGetServerInfo:
      return "GetServerInfo";
    case Rpc::kReloadModels:
      return "ReloadModels";
    case Rpc::kAnimate:
      return "Animate";
  }
  return "";
}

}  // namespace

Call::Call(const Serving& serving, Rpc rpc, Work work, grpc::CallbackServerContext* context)
    : serving_(serving),
      rpc_(rpc),
      work_(work),
      context_(context),
      arrival_(serving.clock.Now()),
      deadline_(SteadyDeadline(context->deadline(), arrival_)),
      span_(BeginSpan(*context)),
      counted_(serving.active.Enter()) {}

Call::~Call() {
  if (counted_) serving_.active.Leave();
}

void Call::Begin() {
  const absl::Status status = Prepare();
  if (!status.ok()) {
    serving_.metrics.CountRejection(ReasonOf(status));
    Answer(status);
    return;
  }
  CallRunner::Item item;
  item.cost = Vertices();
  item.bytes = RequestBytes();
  item.bucket = static_cast<int>(work_);
  item.client = Client();
  item.priority = RequestedPriority();
  item.work = serving_.costs.Estimate(CostKind(), item.cost);
  item.deadline = deadline_;
  item.cancelled = cancelled_;
  item.payload = this;
  item.done = Completion([this](Outcome outcome, Duration retry_after) {
    const absl::Status answer = StatusFor(outcome, retry_after);
    if (outcome != Outcome::kExecuted) serving_.metrics.CountRejection(ReasonOf(answer));
    Answer(answer);
  });
  serving_.runner.Submit(std::move(item));
}

absl::Status Call::Prepare() {
  if (!counted_) {
    request_id_ = MakeRequestId();
    return StatusFor(Outcome::kShuttingDown, Duration(0));
  }
  const absl::StatusOr<std::string> id = ChooseRequestId(RequestedId());
  request_id_ = id.ok() ? *id : MakeRequestId();
  if (!id.ok()) {
    return FieldError(id.status().code(), "INVALID_REQUEST_ID", "request_id",
                      std::string(id.status().message()));
  }
  STANCE_RETURN_IF_ERROR(CheckAccess(serving_.gate, *context_, Vertices(), arrival_, &client_));
  return Plan();
}

void Call::Cancel() {
  MarkCancelled();
  serving_.runner.SweepCancelled();
}

std::string Call::Client() const {
  std::optional<std::string> name;
  if (!client_.empty()) {
    name = client_;  // its token proves it
  } else if (!serving_.client_metadata.empty()) {
    const auto& metadata = context_->client_metadata();
    const auto it = metadata.find(serving_.client_metadata);
    if (it != metadata.end()) name.emplace(it->second.data(), it->second.size());
  }
  return ClientKey(context_->peer(), name);
}

void Call::LearnCost(const PhaseSeconds& core) {
  // The networks see a fixed number of samples, whatever the mesh's size; the other phases see the mesh.
  serving_.costs.Learn(
      CostKind(), {.vertices = Vertices(),
                   .fixed = core.resample + core.network + core.pose,
                   .scaling = seconds_.decode + core.check + core.weights + core.deform + seconds_.encode});
}

absl::Status Call::StatusFor(Outcome outcome, Duration retry_after) {
  switch (outcome) {
    case Outcome::kExecuted:
      return result_;
    case Outcome::kQueueFull:
      return OverloadError("QUEUE_FULL", "too many requests are waiting", kOverloadPushback);
    case Outcome::kQueueBytes:
      return OverloadError("QUEUE_BYTES_FULL", "the requests that are waiting hold too many bytes",
                           kOverloadPushback);
    case Outcome::kQueueCost:
      return OverloadError("QUEUE_VERTICES_FULL", "the requests that are waiting have too many vertices",
                           kOverloadPushback);
    case Outcome::kClientQuota:
      return QuotaError("CLIENT_QUOTA", "too many requests of this client are waiting", kOverloadPushback);
    case Outcome::kTooMuchAhead:
      return OverloadError("DEADLINE_UNMEETABLE",
                           fmt::format("the requests that go before it are expected to make it {:.3f} s late",
                                       ToSeconds(retry_after)),
                           Pushback(retry_after));
    case Outcome::kDeadlineShort:
      return WithReason(absl::DeadlineExceededError("it is expected to take longer than its deadline allows"),
                        "DEADLINE_TOO_SHORT");
    case Outcome::kShuttingDown:
      return ShuttingDownError();
    case Outcome::kCancelled:
      // The deadline, too, reaches a call as a cancellation.
      if (serving_.clock.Now() < deadline_) {
        return WithReason(absl::CancelledError("the caller cancelled the request"), "CANCELLED");
      }
      [[fallthrough]];
    case Outcome::kExpired:
      break;
  }
  return WithReason(absl::DeadlineExceededError("the deadline passed before a worker was free"),
                    "DEADLINE_EXCEEDED");
}

void Call::Answer(absl::Status status) {
  seconds_.total = ToSeconds(serving_.clock.Now() - arrival_);
  if (status.ok()) FinishResponse(request_id_, seconds_);
  serving_.metrics.ObserveRequest(rpc_, status.code(), seconds_.total);
  const std::string code = status.ok() ? "OK" : absl::StatusCodeToString(status.code());
  if (status.ok()) {
    Log(LogLevel::kInfo, "request",
        {{"request_id", request_id_},
         {"rpc", std::string(RpcName(rpc_))},
         {"code", code},
         {"vertices", Vertices()},
         {"queue_seconds", seconds_.queue},
         {"total_seconds", seconds_.total},
         {"client", client_},
         {"trace_id", span_.trace_id},
         {"span_id", span_.span_id},
         {"parent_span_id", span_.parent_id}});
  } else {
    const bool ours =
        status.code() == absl::StatusCode::kInternal || status.code() == absl::StatusCode::kUnknown;
    Log(ours ? LogLevel::kError : LogLevel::kInfo, "request",
        {{"request_id", request_id_},
         {"rpc", std::string(RpcName(rpc_))},
         {"code", code},
         {"reason", ReasonOf(status)},
         {"message", ToGrpcStatus(status).error_message()},
         {"total_seconds", seconds_.total},
         {"client", client_},
         {"trace_id", span_.trace_id},
         {"span_id", span_.span_id},
         {"parent_span_id", span_.parent_id}});
  }
  Send(status);
}

}  // namespace stance
