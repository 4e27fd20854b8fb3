// Stance as a library call: meshes in, meshes out, over gRPC.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "client/answers.h"
#include "client/channel.h"
#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct CallOptions {
  // The whole call, retries and backoff included.
  std::chrono::duration<double> timeout{60.0};
  // The model's name as GetServerInfo lists it. Empty: the server's default.
  std::string model;
  // Up to 64 printable ASCII characters for the server's log. Empty: the server makes one.
  std::string request_id;
  // The caller's span as a W3C traceparent, for the server's log. Empty, or nothing like one: the server
  // begins a trace.
  std::string traceparent;
  // Whether the answer holds the source's weights: where nobody reads them, half of its bytes. The
  // reference's are an option of the transfer.
  bool want_weights = true;
};

// One server, or several behind one name. Thread-safe.
//
// Errors of every call: the server's, as FromGrpcStatus gives them; DEADLINE_EXCEEDED after `timeout`;
// INTERNAL, naming the field, if the answer does not fit the request.
class StanceClient {
 public:
  static absl::StatusOr<std::unique_ptr<StanceClient>> Connect(const ClientOptions& options);
  ~StanceClient();

  // The source in the reference's pose. Faces, texture coordinates and groups of the target are the source's
  // own, copied here; only what the computation reads is sent. Of TransferOptions, `limits` is the server's.
  absl::StatusOr<TransferAnswer> Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                          const TransferOptions& options = {},
                                          const CallOptions& call = {}) const;

  // The source in the pose of each reference; the source is rigged once. A reference that can't be answered
  // has an error of its own. The status is that of the whole: what is wrong with the source, or ends the
  // stream. `call.timeout` is for all of it; nothing is retried once the first answer has come.
  absl::Status Animate(const TriangleMesh& source, const NextReference& next, const TakeAnswer& take,
                       const TransferOptions& options = {}, const CallOptions& call = {}) const;

  // Skeleton and weights of one mesh.
  absl::StatusOr<RigAnswer> Rig(const TriangleMesh& mesh, const TransferOptions& options = {},
                                const CallOptions& call = {}) const;

  absl::StatusOr<ServerInfo> GetServerInfo(const CallOptions& call = {}) const;

  // Has the server load its models again; for a client of its administration's address.
  absl::StatusOr<ReloadAnswer> ReloadModels(const CallOptions& call = {}) const;

 private:
  struct Stubs;
  explicit StanceClient(std::unique_ptr<Stubs> stubs);

  const std::unique_ptr<Stubs> stubs_;
};

}  // namespace stance
