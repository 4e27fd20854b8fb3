#include "client/client.h"

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <optional>
#include <thread>
#include <utility>

#include "client/request.h"
#include "client/response.h"
#include "google/rpc/status.pb.h"
#include "stance/v1/admin.grpc.pb.h"
#include "stance/v1/pose_transfer.grpc.pb.h"
#include "stance/v1/server_info.grpc.pb.h"

namespace stance {
namespace {

void Prepare(const CallOptions& call, const std::string& token, grpc::ClientContext* context) {
  context->set_deadline(std::chrono::system_clock::now() +
                        std::chrono::duration_cast<std::chrono::system_clock::duration>(call.timeout));
  AddToken(token, context);
  // gRPC aborts on metadata that is not printable.
  const bool sane = call.traceparent.find_first_not_of("0123456789abcdef-") == std::string::npos;
  if (sane && !call.traceparent.empty()) context->AddMetadata("traceparent", call.traceparent);
}

}  // namespace

struct StanceClient::Stubs {
  Stubs(std::shared_ptr<grpc::Channel> channel, std::string bearer)
      : admin(v1::AdminService::NewStub(channel)),
        transfer(v1::PoseTransferService::NewStub(channel)),
        info(v1::ServerInfoService::NewStub(channel)),
        token(std::move(bearer)) {}

  const std::unique_ptr<v1::AdminService::Stub> admin;
  const std::unique_ptr<v1::PoseTransferService::Stub> transfer;
  const std::unique_ptr<v1::ServerInfoService::Stub> info;
  const std::string token;
};

absl::StatusOr<std::unique_ptr<StanceClient>> StanceClient::Connect(const ClientOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::shared_ptr<grpc::Channel> channel, ConnectChannel(options));
  return std::unique_ptr<StanceClient>(
      new StanceClient(std::make_unique<Stubs>(std::move(channel), options.token)));
}

StanceClient::StanceClient(std::unique_ptr<Stubs> stubs) : stubs_(std::move(stubs)) {}
StanceClient::~StanceClient() = default;

absl::StatusOr<TransferAnswer> StanceClient::Transfer(const TriangleMesh& source,
                                                      const TriangleMesh& reference,
                                                      const TransferOptions& options,
                                                      const CallOptions& call) const {
  const v1::TransferRequest request = MakeTransferRequest(source, reference, options, call);
  v1::TransferResponse response;
  grpc::ClientContext context;
  Prepare(call, stubs_->token, &context);
  const grpc::Status status = stubs_->transfer->Transfer(&context, request, &response);
  if (!status.ok()) return FromGrpcStatus(status);
  return ReadTransferResponse(response, source);
}

absl::Status StanceClient::Animate(const TriangleMesh& source, const NextReference& next,
                                   const TakeAnswer& take, const TransferOptions& options,
                                   const CallOptions& call) const {
  grpc::ClientContext context;
  Prepare(call, stubs_->token, &context);
  const auto stream = stubs_->transfer->Animate(&context);
  // The server reads on only as far as it is read from.
  std::jthread writer([&] {
    bool open = stream->Write(MakeAnimateStart(source, options, call));
    while (open) {
      const std::optional<TriangleMesh> reference = next();
      if (!reference) break;
      open = stream->Write(MakeAnimateReference(*reference, options));
    }
    stream->WritesDone();
  });
  v1::AnimateResponse response;
  while (stream->Read(&response)) {
    if (response.has_transfer()) {
      take(ReadTransferResponse(response.transfer(), source));
    } else {
      const google::rpc::Status& error = response.error();
      take(FromGrpcStatus(grpc::Status(static_cast<grpc::StatusCode>(error.code()), error.message(),
                                       error.SerializeAsString())));
    }
  }
  writer.join();
  return FromGrpcStatus(stream->Finish());
}

absl::StatusOr<RigAnswer> StanceClient::Rig(const TriangleMesh& mesh, const TransferOptions& options,
                                            const CallOptions& call) const {
  const v1::RigRequest request = MakeRigRequest(mesh, options, call);
  v1::RigResponse response;
  grpc::ClientContext context;
  Prepare(call, stubs_->token, &context);
  const grpc::Status status = stubs_->transfer->Rig(&context, request, &response);
  if (!status.ok()) return FromGrpcStatus(status);
  return ReadRigResponse(response, mesh);
}

absl::StatusOr<ServerInfo> StanceClient::GetServerInfo(const CallOptions& call) const {
  v1::GetServerInfoResponse response;
  grpc::ClientContext context;
  Prepare(call, stubs_->token, &context);
  const grpc::Status status = stubs_->info->GetServerInfo(&context, {}, &response);
  if (!status.ok()) return FromGrpcStatus(status);
  return ReadServerInfo(response);
}

absl::StatusOr<ReloadAnswer> StanceClient::ReloadModels(const CallOptions& call) const {
  v1::ReloadModelsResponse response;
  grpc::ClientContext context;
  Prepare(call, stubs_->token, &context);
  const grpc::Status status = stubs_->admin->ReloadModels(&context, {}, &response);
  if (!status.ok()) return FromGrpcStatus(status);
  return ReadReloadResponse(response);
}

}  // namespace stance
