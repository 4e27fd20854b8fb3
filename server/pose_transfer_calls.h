// The calls of PoseTransferService, and how a worker runs a batch of them.
#pragma once

#include <span>
#include <string>

#include "core/transfer/pipeline.h"
#include "server/call.h"
#include "server/convert.h"
#include "stance/v1/pose_transfer.pb.h"

namespace stance {

// What a worker runs as a TransferJob. Plan on the gRPC thread; Decode, MakeJob and Encode on a worker.
class TransferWork : public Call {
 public:
  using Job = TransferJob;
  using Result = TransferResult;

  virtual absl::Status Decode() = 0;
  // Points into this call.
  virtual Job MakeJob() const = 0;
  virtual absl::Status Encode(const Result& result) = 0;

 protected:
  TransferWork(const Serving& serving, Rpc rpc, grpc::CallbackServerContext* context)
      : Call(serving, rpc, Work::kTransfer, context) {}
};

// `catalog` outlives the call, as it does below.
class TransferCall : public TransferWork {
 public:
  absl::Status Decode() override;
  Job MakeJob() const override {
    return {&source_, &reference_, plan_.options, [this] { return is_cancelled(); }};
  }
  absl::Status Encode(const Result& result) override;

 protected:
  TransferCall(grpc::CallbackServerContext* context, const Serving& serving, const Catalog& catalog,
               const v1::TransferRequest* request, v1::TransferResponse* response);

 private:
  absl::Status Plan() override;
  const std::string& RequestedId() const override { return request_.request_id(); }
  int64_t Vertices() const override;
  int64_t RequestBytes() const override;
  Priority RequestedPriority() const override { return plan_.priority; }
  int CostKind() const override;
  void FinishResponse(const std::string& request_id, const ServerSeconds& seconds) override;

  const Catalog& catalog_;
  const v1::TransferRequest& request_;
  v1::TransferResponse& response_;
  TransferPlan plan_;
  TriangleMesh source_;
  TriangleMesh reference_;
};

// As above.
class RigCall : public Call {
 public:
  using Job = RigJob;
  using Result = RigResult;

  absl::Status Decode();
  Job MakeJob() const {
    return {&mesh_, plan_.options, [this] { return is_cancelled(); }};
  }
  absl::Status Encode(const Result& result);

 protected:
  RigCall(grpc::CallbackServerContext* context, const Serving& serving, const Catalog& catalog,
          const v1::RigRequest* request, v1::RigResponse* response);

 private:
  absl::Status Plan() override;
  const std::string& RequestedId() const override { return request_.request_id(); }
  int64_t Vertices() const override;
  int64_t RequestBytes() const override;
  Priority RequestedPriority() const override { return plan_.priority; }
  int CostKind() const override;
  void FinishResponse(const std::string& request_id, const ServerSeconds& seconds) override;

  const Catalog& catalog_;
  const v1::RigRequest& request_;
  v1::RigResponse& response_;
  RigPlan plan_;
  TriangleMesh mesh_;
};

// Requests of one RPC and method cost alike.
int CostKindOf(Rpc rpc, const TransferOptions& options);

void WriteSeconds(const ServerSeconds& seconds, v1::PhaseTimings* timings);

// Runs a batch of one kind of work: reads the meshes, runs the pipeline on those that are well-formed, and
// answers each call as soon as its answer is written. A bad call does not touch its neighbours.
void RunCalls(const Pipeline& pipeline, Metrics& metrics, Clock& clock, std::span<CallRunner::Item> batch);

}  // namespace stance
