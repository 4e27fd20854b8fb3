// AdminService: what operators may do.
#pragma once

#include "server/access/token_gate.h"
#include "server/metrics.h"
#include "server/model_repository.h"
#include "stance/v1/admin.grpc.pb.h"

namespace stance {

// Thread-safe. What it refers to outlives it; the repository is closed before the gRPC server, so that no
// call is left open.
class AdminServiceImpl final : public v1::AdminService::CallbackService {
 public:
  AdminServiceImpl(ModelRepository& models, TokenGate& gate, Metrics& metrics)
      : models_(models), gate_(gate), metrics_(metrics) {}

  grpc::ServerUnaryReactor* ReloadModels(grpc::CallbackServerContext* context,
                                         const v1::ReloadModelsRequest* request,
                                         v1::ReloadModelsResponse* response) override;

 private:
  ModelRepository& models_;
  TokenGate& gate_;
  Metrics& metrics_;
};

}  // namespace stance
