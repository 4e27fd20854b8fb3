#include "server/animate_calls.h"

#include <utility>

#include "google/rpc/status.pb.h"
#include "server/status_map.h"

namespace stance {

SourceCall::SourceCall(grpc::CallbackServerContext* context, const Serving& serving, const Catalog& catalog,
                       AnimateSource& source, AnimateOwner& owner)
    : Call(serving, Rpc::kAnimate, Work::kRigSource, context),
      catalog_(catalog),
      source_(source),
      owner_(owner),
      vertices_(EstimateVertices(source.start.source())),
      bytes_(static_cast<int64_t>(source.start.ByteSizeLong())) {}

absl::Status SourceCall::Plan() {
  STANCE_ASSIGN_OR_RETURN(source_.plan, PlanAnimate(source_.start, catalog_));
  return absl::OkStatus();
}

absl::Status SourceCall::Decode() {
  STANCE_ASSIGN_OR_RETURN(source_.mesh,
                          DecodeMesh(source_.start.source(), "source", source_.plan.options.limits));
  source_.up_axis = source_.start.source().up_axis();
  source_.start.clear_source();
  return absl::OkStatus();
}

absl::Status SourceCall::Encode(const Result& result) {
  source_.rigged = result.rigged;
  return absl::OkStatus();
}

ReferenceCall::ReferenceCall(grpc::CallbackServerContext* context, const Serving& serving,
                             const Catalog& catalog, const AnimateSource& source, uint64_t index,
                             v1::AnimateReference reference, AnimateOwner& owner)
    : TransferWork(serving, Rpc::kAnimate, context),
      catalog_(catalog),
      source_(source),
      owner_(owner),
      index_(index),
      reference_(std::move(reference)),
      vertices_(EstimateVertices(reference_.reference())),
      bytes_(static_cast<int64_t>(reference_.ByteSizeLong())) {
  response_.set_index(index);
}

absl::Status ReferenceCall::Plan() {
  STANCE_ASSIGN_OR_RETURN(up_, PlanReference(reference_));
  return absl::OkStatus();
}

absl::Status ReferenceCall::Decode() {
  STANCE_ASSIGN_OR_RETURN(mesh_,
                          DecodeMesh(reference_.reference(), "reference", source_.plan.options.limits));
  reference_.clear_reference();
  return absl::OkStatus();
}

ReferenceCall::Job ReferenceCall::MakeJob() const {
  Job job{&source_.mesh, &mesh_, source_.plan.options, [this] { return is_cancelled(); }, source_.rigged};
  job.options.reference_up = up_;
  return job;
}

absl::Status ReferenceCall::Encode(const Result& result) {
  return EncodeTransfer(source_.plan, result, catalog_, source_.up_axis, response_.mutable_transfer());
}

void ReferenceCall::FinishResponse(const std::string& request_id, const ServerSeconds& seconds) {
  response_.mutable_transfer()->set_request_id(request_id);
  WriteSeconds(seconds, response_.mutable_transfer()->mutable_timings());
}

void ReferenceCall::Send(const absl::Status& status) {
  response_.set_request_id(request_id());
  if (!status.ok()) response_.mutable_error()->ParseFromString(ToGrpcStatus(status).error_details());
  owner_.ReferenceAnswered(index_);
}

}  // namespace stance
