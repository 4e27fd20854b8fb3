// The calls of PoseTransferService, and how a worker runs a batch of them.
#pragma once

#include <span>
#include <string>

#include "core/transfer/pipeline.h"
#include "server/call.h"
#include "server/convert.h"
#include "stance/v1/pose_transfer.pb.h"

namespace stance {

// Plan on the gRPC thread; Decode, MakeJob and Encode on a worker. `catalog` outlives the call.
class TransferCall : public Call {
 public:
  using Job = TransferJob;
  using Result = TransferResult;

  TransferCall(const Serving& serving, const Catalog& catalog, grpc::CallbackServerContext* context,
               const v1::TransferRequest* request, v1::TransferResponse* response);

  absl::Status Decode();
  // Points into this call.
  Job MakeJob() const {
    return {&source_, &reference_, plan_.options, [this] { return is_cancelled(); }};
  }
  absl::Status Encode(const Result& result);

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

  RigCall(const Serving& serving, const Catalog& catalog, grpc::CallbackServerContext* context,
          const v1::RigRequest* request, v1::RigResponse* response);

  absl::Status Decode();
  Job MakeJob() const {
    return {&mesh_, plan_.options, [this] { return is_cancelled(); }};
  }
  absl::Status Encode(const Result& result);

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

// Runs a batch of one kind of call: reads the meshes, runs the pipeline on those that are well-formed, and
// answers each call as soon as its answer is written. A bad call does not touch its neighbours.
void RunCalls(const Pipeline& pipeline, Metrics& metrics, Clock& clock, std::span<CallRunner::Item> batch);

}  // namespace stance
