#include "server/services.h"

#include "core/base/stopwatch.h"
#include "server/pose_transfer_calls.h"

namespace stance {

// A call deletes itself in OnDone.

grpc::ServerUnaryReactor* PoseTransferServiceImpl::Transfer(grpc::CallbackServerContext* context,
                                                            const v1::TransferRequest* request,
                                                            v1::TransferResponse* response) {
  auto* call = new TransferCall(serving_, catalog_, context, request, response);
  call->Begin();
  return call;
}

grpc::ServerUnaryReactor* PoseTransferServiceImpl::Rig(grpc::CallbackServerContext* context,
                                                       const v1::RigRequest* request,
                                                       v1::RigResponse* response) {
  auto* call = new RigCall(serving_, catalog_, context, request, response);
  call->Begin();
  return call;
}

grpc::ServerUnaryReactor* ServerInfoServiceImpl::GetServerInfo(grpc::CallbackServerContext* context,
                                                               const v1::GetServerInfoRequest*,
                                                               v1::GetServerInfoResponse* response) {
  Stopwatch watch;
  *response = info_;
  metrics_.ObserveRequest(Rpc::kGetServerInfo, absl::StatusCode::kOk, watch.Lap());
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace stance
