#include "server/admin_service.h"

#include <string>

#include "core/base/clock.h"
#include "server/call_metadata.h"
#include "server/convert.h"
#include "server/status_map.h"

namespace stance {

grpc::ServerUnaryReactor* AdminServiceImpl::ReloadModels(grpc::CallbackServerContext* context,
                                                         const v1::ReloadModelsRequest*,
                                                         v1::ReloadModelsResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  // Also when the caller has gone by then: the reactor waits for it.
  const auto finish = [this, context, reactor, arrival = RealClock().Now()](const absl::Status& status) {
    AddAnswerMetadata(*context, BeginSpan(*context), status);
    metrics_.ObserveRequest(Rpc::kReloadModels, status.code(), ToSeconds(RealClock().Now() - arrival));
    reactor->Finish(ToGrpcStatus(status));
  };
  std::string client;
  const absl::Status access = CheckAdmin(gate_, *context, RealClock().Now(), &client);
  if (!access.ok()) {
    metrics_.CountRejection(ReasonOf(access));
    finish(access);
    return reactor;
  }
  models_.Reload([this, response, finish](const absl::StatusOr<bool>& switched) {
    if (switched.ok()) {
      response->set_switched(*switched);
      for (const ModelInfo& model : models_.current()->models()) ModelToWire(model, response->add_models());
    }
    finish(switched.status());
  });
  return reactor;
}

}  // namespace stance
