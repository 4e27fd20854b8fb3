// The gRPC services. Each method makes a call and begins it, nothing else.
#pragma once

#include "server/call.h"
#include "server/convert.h"
#include "server/model_repository.h"
#include "stance/v1/pose_transfer.grpc.pb.h"
#include "stance/v1/server_info.grpc.pb.h"

namespace stance {

// Thread-safe. What it refers to outlives it.
class PoseTransferServiceImpl final : public v1::PoseTransferService::CallbackService {
 public:
  PoseTransferServiceImpl(const Serving& serving, const Catalog& catalog)
      : serving_(serving), catalog_(catalog) {}

  grpc::ServerUnaryReactor* Transfer(grpc::CallbackServerContext* context, const v1::TransferRequest* request,
                                     v1::TransferResponse* response) override;
  grpc::ServerUnaryReactor* Rig(grpc::CallbackServerContext* context, const v1::RigRequest* request,
                                v1::RigResponse* response) override;
  grpc::ServerBidiReactor<v1::AnimateRequest, v1::AnimateResponse>* Animate(
      grpc::CallbackServerContext* context) override;

 private:
  const Serving serving_;
  const Catalog& catalog_;
};

// Answers with the same message every time, but for the models. Thread-safe. What it refers to outlives it.
class ServerInfoServiceImpl final : public v1::ServerInfoService::CallbackService {
 public:
  // `info`: without models and their methods.
  ServerInfoServiceImpl(v1::GetServerInfoResponse info, const ModelRepository& models, const Serving& serving)
      : info_(std::move(info)), models_(models), serving_(serving) {}

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;

 private:
  const v1::GetServerInfoResponse info_;
  const ModelRepository& models_;
  const Serving serving_;
};

}  // namespace stance
