// The gRPC channel that the client library and the load generator share.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "core/base/status.h"

namespace grpc {
class Channel;
class ClientContext;
class Status;
}  // namespace grpc

namespace stance {

// Encryption, with texts in PEM.
struct ClientTls {
  std::string authorities;  // of the server's certificate; empty: the system's
  std::string certificate;  // the client's own chain and key, for mutual TLS; empty: none
  std::string key;
  std::string server_name;  // the name in the server's certificate; empty: that of `server`
};

struct ClientOptions {
  // HOST:PORT, or any gRPC target ("unix:/run/stance.sock", "dns:///stance:50051").
  std::string server = "localhost:50051";
  // Unset: no encryption.
  std::optional<ClientTls> tls;
  // The bearer token that every call brings. Empty: none.
  std::string token;
  // How long Connect waits for the first connection.
  std::chrono::duration<double> connect_timeout{5.0};
  // Largest message sent or received, bytes. The server has its own limit: see GetServerInfo.
  int max_message_bytes = 512 * 1024 * 1024;
  // Attempts per call, 1 to 5. A call is repeated only after UNAVAILABLE, with exponential backoff or after
  // the pause that the server asked for; both calls are stateless, so that a repeat is harmless. 1: no retry.
  int max_attempts = 4;
};

// The service config that ClientOptions mean, as JSON: retry and round-robin load balancing.
std::string ServiceConfigJson(const ClientOptions& options);

// INVALID_ARGUMENT if the token is not printable ASCII, or would travel to another machine without
// encryption, where everyone on the way could read it.
absl::Status CheckCredentials(const ClientOptions& options);

// Connects. UNAVAILABLE, naming the server, if that takes longer than connect_timeout; errors as
// CheckCredentials.
absl::StatusOr<std::shared_ptr<grpc::Channel>> ConnectChannel(const ClientOptions& options);

// Puts the token, if there is one, into the metadata of a call.
void AddToken(const std::string& token, grpc::ClientContext* context);

// The same code and text; the fields of a BadRequest that the text does not name come before it, the reason
// of an ErrorInfo after it: "source.arrays.positions: 13 bytes ... [INVALID_MESH]".
absl::Status FromGrpcStatus(const grpc::Status& status);

}  // namespace stance
