// The gRPC channel that the client library and the load generator share.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "core/base/status.h"

namespace grpc {
class Channel;
class Status;
}  // namespace grpc

namespace stance {

struct ClientOptions {
  // HOST:PORT, or any gRPC target ("unix:/run/stance.sock", "dns:///stance:50051").
  std::string server = "localhost:50051";
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

// Connects, without encryption. UNAVAILABLE, naming the server, if that takes longer than connect_timeout.
absl::StatusOr<std::shared_ptr<grpc::Channel>> ConnectChannel(const ClientOptions& options);

// The same code and text; the fields of a BadRequest that the text does not name come before it, the reason
// of an ErrorInfo after it: "source.arrays.positions: 13 bytes ... [INVALID_MESH]".
absl::Status FromGrpcStatus(const grpc::Status& status);

}  // namespace stance
