#include "server/pose_transfer_calls.h"

#include <utility>
#include <vector>

#include "core/base/stopwatch.h"
#include "server/animate_calls.h"
#include "server/isolated.h"
#include "server/status_map.h"

namespace stance {
namespace {

void ObservePhases(Metrics& metrics, const PhaseSeconds& core, const ServerSeconds& server) {
  metrics.ObservePhase(Phase::kDecode, server.decode);
  metrics.ObservePhase(Phase::kCheck, core.check);
  metrics.ObservePhase(Phase::kResample, core.resample);
  metrics.ObservePhase(Phase::kNetwork, core.network);
  metrics.ObservePhase(Phase::kPose, core.pose);
  metrics.ObservePhase(Phase::kWeights, core.weights);
  metrics.ObservePhase(Phase::kDeform, core.deform);
  metrics.ObservePhase(Phase::kEncode, server.encode);
}

void RunJobs(const Pipeline& pipeline, std::span<const TransferJob> jobs,
             std::vector<absl::StatusOr<TransferResult>>& results) {
  results = pipeline.TransferBatch(jobs);
}
void RunJobs(const Pipeline& pipeline, std::span<const RigJob> jobs,
             std::vector<absl::StatusOr<RigResult>>& results) {
  results = pipeline.RigBatch(jobs);
}
void RunJobs(const Pipeline& pipeline, std::span<const RigJob> jobs,
             std::vector<absl::StatusOr<RigSourceResult>>& results) {
  results = pipeline.RigSources(jobs);
}

absl::Status GaveUp() {
  return WithReason(absl::CancelledError("the caller gave the request up"), "CANCELLED");
}

template <typename SomeCall>
void RunTyped(const Pipeline& pipeline, Metrics& metrics, std::span<CallRunner::Item> batch) {
  std::vector<CallRunner::Item*> ready;
  std::vector<typename SomeCall::Job> jobs;
  for (CallRunner::Item& item : batch) {
    auto& call = static_cast<SomeCall&>(*item.payload);
    Stopwatch watch;
    const absl::Status decoded =
        call.is_cancelled() ? GaveUp() : Guarded("reading the request", [&] { return call.Decode(); });
    call.seconds().decode = watch.Lap();
    if (!decoded.ok()) {
      metrics.CountRejection(ReasonOf(decoded));
      call.set_result(decoded);
      item.done(Outcome::kExecuted);
      continue;
    }
    ready.push_back(&item);
    jobs.push_back(call.MakeJob());
  }
  if (jobs.empty()) return;
  using Job = typename SomeCall::Job;
  auto results = RunIsolated<typename SomeCall::Result>(
      "running the batch", std::span<const Job>(jobs), [&](std::span<const Job> some) {
        std::vector<absl::StatusOr<typename SomeCall::Result>> results_of_some;
        RunJobs(pipeline, some, results_of_some);
        return results_of_some;
      });
  for (size_t i = 0; i < ready.size(); ++i) {
    auto& call = static_cast<SomeCall&>(*ready[i]->payload);
    absl::Status status = results[i].status();
    if (status.code() == absl::StatusCode::kInvalidArgument) {
      metrics.CountRejection("INVALID_MESH");
      status = NameField(status, "INVALID_MESH", "");
    } else if (status.code() == absl::StatusCode::kCancelled || call.is_cancelled()) {
      metrics.CountAbandoned();
      status = GaveUp();
    } else if (status.ok()) {
      Stopwatch watch;
      status = Guarded("writing the answer", [&] { return call.Encode(*results[i]); });
      call.seconds().encode = watch.Lap();
      ObservePhases(metrics, results[i]->seconds, call.seconds());
      call.LearnCost(results[i]->seconds);
    } else {
      metrics.CountRejection(ReasonOf(status));
    }
    call.set_result(std::move(status));
    results[i] = absl::CancelledError("answered");  // frees the result before the next one is encoded
    ready[i]->done(Outcome::kExecuted);
  }
}

}  // namespace

int CostKindOf(Rpc rpc, const TransferOptions& options) {
  constexpr int kMostMethods = 16;
  return static_cast<int>(rpc) * kMostMethods + static_cast<int>(options.method.value_or(Method::kSkeletal));
}

void WriteSeconds(const ServerSeconds& seconds, v1::PhaseTimings* timings) {
  timings->set_queue_seconds(seconds.queue);
  timings->set_decode_seconds(seconds.decode);
  timings->set_encode_seconds(seconds.encode);
  timings->set_total_seconds(seconds.total);
}

TransferCall::TransferCall(grpc::CallbackServerContext* context, const Serving& serving,
                           const Catalog& catalog, const v1::TransferRequest* request,
                           v1::TransferResponse* response)
    : TransferWork(serving, Rpc::kTransfer, context),
      catalog_(catalog),
      request_(*request),
      response_(*response) {}

absl::Status TransferCall::Plan() {
  STANCE_ASSIGN_OR_RETURN(plan_, PlanTransfer(request_, catalog_));
  return absl::OkStatus();
}

int64_t TransferCall::Vertices() const {
  return EstimateVertices(request_.source()) + EstimateVertices(request_.reference());
}

int TransferCall::CostKind() const { return CostKindOf(rpc(), plan_.options); }

int64_t TransferCall::RequestBytes() const { return static_cast<int64_t>(request_.ByteSizeLong()); }

absl::Status TransferCall::Decode() {
  STANCE_ASSIGN_OR_RETURN(source_, DecodeMesh(request_.source(), "source", plan_.options.limits));
  STANCE_ASSIGN_OR_RETURN(reference_, DecodeMesh(request_.reference(), "reference", plan_.options.limits));
  return absl::OkStatus();
}

absl::Status TransferCall::Encode(const Result& result) {
  return EncodeTransfer(plan_, result, catalog_, request_.source().up_axis(), &response_);
}

void TransferCall::FinishResponse(const std::string& request_id, const ServerSeconds& seconds) {
  response_.set_request_id(request_id);
  WriteSeconds(seconds, response_.mutable_timings());
}

RigCall::RigCall(grpc::CallbackServerContext* context, const Serving& serving, const Catalog& catalog,
                 const v1::RigRequest* request, v1::RigResponse* response)
    : Call(serving, Rpc::kRig, Work::kRig, context),
      catalog_(catalog),
      request_(*request),
      response_(*response) {}

absl::Status RigCall::Plan() {
  STANCE_ASSIGN_OR_RETURN(plan_, PlanRig(request_, catalog_));
  return absl::OkStatus();
}

int64_t RigCall::Vertices() const { return EstimateVertices(request_.mesh()); }

int RigCall::CostKind() const { return CostKindOf(rpc(), plan_.options); }

int64_t RigCall::RequestBytes() const { return static_cast<int64_t>(request_.ByteSizeLong()); }

absl::Status RigCall::Decode() {
  STANCE_ASSIGN_OR_RETURN(mesh_, DecodeMesh(request_.mesh(), "mesh", plan_.options.limits));
  return absl::OkStatus();
}

absl::Status RigCall::Encode(const Result& result) {
  EncodeRig(plan_, result, catalog_, &response_);
  return absl::OkStatus();
}

void RigCall::FinishResponse(const std::string& request_id, const ServerSeconds& seconds) {
  response_.set_request_id(request_id);
  WriteSeconds(seconds, response_.mutable_timings());
}

void RunCalls(const Pipeline& pipeline, Metrics& metrics, Clock& clock, std::span<CallRunner::Item> batch) {
  const TimePoint now = clock.Now();
  int64_t vertices = 0;
  for (CallRunner::Item& item : batch) {
    vertices += item.cost;
    if (now > item.payload->deadline()) metrics.CountLateStart();
    item.payload->seconds().queue = ToSeconds(now - item.admitted);
    metrics.ObservePhase(Phase::kQueue, item.payload->seconds().queue);
  }
  metrics.ObserveBatch(static_cast<int64_t>(batch.size()), vertices);
  switch (batch.front().payload->work()) {
    case Work::kTransfer:
      return RunTyped<TransferWork>(pipeline, metrics, batch);
    case Work::kRig:
      return RunTyped<RigCall>(pipeline, metrics, batch);
    case Work::kRigSource:
      return RunTyped<SourceCall>(pipeline, metrics, batch);
  }
}

}  // namespace stance
