#include "server/services.h"

#include "core/base/stopwatch.h"
#include "server/animate_stream.h"
#include "server/call_metadata.h"
#include "server/pose_transfer_calls.h"
#include "server/status_map.h"
#include "server/unary.h"

namespace stance {

// A reactor deletes itself in OnDone.

grpc::ServerUnaryReactor* PoseTransferServiceImpl::Transfer(grpc::CallbackServerContext* context,
                                                            const v1::TransferRequest* request,
                                                            v1::TransferResponse* response) {
  auto* call = new Unary<TransferCall>(context, serving_, catalog_, request, response);
  call->Begin();
  return call;
}

grpc::ServerUnaryReactor* PoseTransferServiceImpl::Rig(grpc::CallbackServerContext* context,
                                                       const v1::RigRequest* request,
                                                       v1::RigResponse* response) {
  auto* call = new Unary<RigCall>(context, serving_, catalog_, request, response);
  call->Begin();
  return call;
}

grpc::ServerBidiReactor<v1::AnimateRequest, v1::AnimateResponse>* PoseTransferServiceImpl::Animate(
    grpc::CallbackServerContext* context) {
  return new AnimateStream(serving_, catalog_, context);
}

grpc::ServerUnaryReactor* ServerInfoServiceImpl::GetServerInfo(grpc::CallbackServerContext* context,
                                                               const v1::GetServerInfoRequest*,
                                                               v1::GetServerInfoResponse* response) {
  Stopwatch watch;
  std::string client;
  const absl::Status status = CheckAccess(serving_.gate, *context, 0, serving_.clock.Now(), &client);
  if (status.ok()) {
    *response = info_;
    for (const ModelInfo& model : models_.current()->models()) {
      ModelToWire(model, response->add_models());
      response->add_methods(MethodToWire(model.method));
    }
    response->set_default_method(response->methods(0));
  } else {
    serving_.metrics.CountRejection(ReasonOf(status));
  }
  AddAnswerMetadata(*context, BeginSpan(*context), status);
  serving_.metrics.ObserveRequest(Rpc::kGetServerInfo, status.code(), watch.Lap());
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(ToGrpcStatus(status));
  return reactor;
}

}  // namespace stance
