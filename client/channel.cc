#include "client/channel.h"

#include <fmt/format.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <algorithm>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace stance {
namespace {

// Whether the target can only be on this machine. A name that is not known says no.
bool IsLocal(std::string target) {
  for (const char* scheme : {"unix:", "unix-abstract:"}) {
    if (target.starts_with(scheme)) return true;
  }
  for (const std::string scheme : {"dns:///", "dns:", "ipv4:", "ipv6:"}) {
    if (target.starts_with(scheme)) {
      target = target.substr(scheme.size());
      break;
    }
  }
  // A list of addresses is as local as its first one only seems to be.
  if (target.find(',') != std::string::npos) return false;
  const size_t colon = target.rfind(':');
  const std::string host = target.ends_with(']') ? target : target.substr(0, colon);
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

std::shared_ptr<grpc::ChannelCredentials> CredentialsOf(const ClientOptions& options) {
  if (!options.tls) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  ssl.pem_root_certs = options.tls->authorities;
  ssl.pem_cert_chain = options.tls->certificate;
  ssl.pem_private_key = options.tls->key;
  return grpc::SslCredentials(ssl);
}

}  // namespace

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

absl::Status CheckCredentials(const ClientOptions& options) {
  // gRPC aborts on metadata that is not printable.
  if (std::any_of(options.token.begin(), options.token.end(), [](char c) { return c < 0x20 || c > 0x7e; })) {
    return absl::InvalidArgumentError("the token is not printable ASCII");
  }
  if (options.token.empty() || options.tls || IsLocal(options.server)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      fmt::format("server {}: a token goes to another machine with TLS only", options.server));
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> ConnectChannel(const ClientOptions& options) {
  STANCE_RETURN_IF_ERROR(CheckCredentials(options));
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(options.max_message_bytes);
  arguments.SetMaxSendMessageSize(options.max_message_bytes);
  arguments.SetServiceConfigJSON(ServiceConfigJson(options));
  // A message larger than the retry buffer is sent but not repeated, and the default of 256 KiB is less than
  // most meshes.
  arguments.SetInt(GRPC_ARG_PER_RPC_RETRY_BUFFER_SIZE, options.max_message_bytes);
  // Not shared with other channels of the process that have the same arguments.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  if (options.tls && !options.tls->server_name.empty()) {
    arguments.SetSslTargetNameOverride(options.tls->server_name);
  }
  std::shared_ptr<grpc::Channel> channel =
      grpc::CreateCustomChannel(options.server, CredentialsOf(options), arguments);
  const auto deadline =
      std::chrono::system_clock::now() +
      std::chrono::duration_cast<std::chrono::system_clock::duration>(options.connect_timeout);
  if (!channel->WaitForConnected(deadline)) {
    return absl::UnavailableError(fmt::format("server {}: no connection within {:g} s {} TLS", options.server,
                                              options.connect_timeout.count(),
                                              options.tls ? "with" : "without"));
  }
  return channel;
}

void AddToken(const std::string& token, grpc::ClientContext* context) {
  if (!token.empty()) context->AddMetadata("authorization", "Bearer " + token);
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
