// A call that is a gRPC method of its own: one request, one answer.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <utility>

#include "server/call_metadata.h"
#include "server/status_map.h"

namespace stance {

// A reactor that owns itself: OnDone deletes it. The call comes first among the bases, so that it is the last
// to go: with it the server knows the reactor gone.
template <typename SomeCall>
class Unary final : public SomeCall, public grpc::ServerUnaryReactor {
 public:
  template <typename... Arguments>
  explicit Unary(grpc::CallbackServerContext* context, Arguments&&... arguments)
      : SomeCall(context, std::forward<Arguments>(arguments)...), context_(context) {}

  void OnCancel() override { this->Cancel(); }
  void OnDone() override { delete this; }

 private:
  void Send(const absl::Status& status) override {
    AddAnswerMetadata(*context_, this->span(), status);
    Finish(ToGrpcStatus(status));
  }

  grpc::CallbackServerContext* const context_;
};

}  // namespace stance
