#include "client/channel.h"

#include <fmt/format.h>
#include <grpcpp/channel.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace stance {

std::string ServiceConfigJson(const ClientOptions& options) {
  constexpr char kServices[] =
      R"([{"service":"stance.v1.PoseTransferService"},{"service":"stance.v1.ServerInfoService"}])";
  std::string retry;
  if (options.max_attempts > 1) {
    retry = fmt::format(R"(,"retryPolicy":{{"maxAttempts":{},"initialBackoff":"0.1s","maxBackoff":"2s",)"
                        R"("backoffMultiplier":2,"retryableStatusCodes":["UNAVAILABLE"]}})",
                        options.max_attempts);
  }
  return fmt::format(R"({{"loadBalancingConfig":[{{"round_robin":{{}}}}],"methodConfig":[{{"name":{}{}}}]}})",
                     kServices, retry);
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> ConnectChannel(const ClientOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(options.max_message_bytes);
  arguments.SetMaxSendMessageSize(options.max_message_bytes);
  arguments.SetServiceConfigJSON(ServiceConfigJson(options));
  // A message larger than the retry buffer is sent but not repeated, and the default of 256 KiB is less than
  // most meshes.
  arguments.SetInt(GRPC_ARG_PER_RPC_RETRY_BUFFER_SIZE, options.max_message_bytes);
  // Not shared with other channels of the process that have the same arguments.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  std::shared_ptr<grpc::Channel> channel =
      grpc::CreateCustomChannel(options.server, grpc::InsecureChannelCredentials(), arguments);
  const auto deadline =
      std::chrono::system_clock::now() +
      std::chrono::duration_cast<std::chrono::system_clock::duration>(options.connect_timeout);
  if (!channel->WaitForConnected(deadline)) {
    return absl::UnavailableError(fmt::format("server {}: no connection within {:g} s", options.server,
                                              options.connect_timeout.count()));
  }
  return channel;
}

absl::Status FromGrpcStatus(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  std::string text = status.error_message();
  google::rpc::Status details;
  if (!status.error_details().empty() && details.ParseFromString(status.error_details())) {
    for (const google::protobuf::Any& any : details.details()) {
      google::rpc::BadRequest bad_request;
      google::rpc::ErrorInfo info;
      if (any.UnpackTo(&bad_request)) {
        for (const auto& violation : bad_request.field_violations()) {
          if (text.find(violation.field()) == std::string::npos) text = violation.field() + ": " + text;
        }
      } else if (any.UnpackTo(&info)) {
        text += fmt::format(" [{}]", info.reason());
      }
    }
  }
  // gRPC's codes and absl's have the same numbers.
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), text);
}

}  // namespace stance
