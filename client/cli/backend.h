// Where a command's work is done: on a server or in this process.
#pragma once

#include <memory>

#include "client/answers.h"
#include "client/cli/arguments.h"
#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/pipeline.h"

namespace stance {

// Errors carry their exit code (exit_code.h) and begin with the field: "source: ...", "reference: ...".
class Backend {
 public:
  virtual ~Backend() = default;

  // Joints have the skeleton's own names. The answer has weights if `want_weights`; the reference's never.
  virtual absl::StatusOr<TransferAnswer> Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                                  const TransferOptions& options, bool want_weights) = 0;
  // As StanceClient::Animate. Joints have the skeleton's own names.
  virtual absl::Status Animate(const TriangleMesh& source, const TransferOptions& options,
                               const NextReference& next, const TakeAnswer& take) = 0;
  virtual absl::StatusOr<RigAnswer> Rig(const TriangleMesh& mesh, const TransferOptions& options) = 0;
};

// How to reach the server that the arguments name. Errors as ReadCredentials.
absl::StatusOr<ClientOptions> ClientOptionsOf(const BackendArguments& arguments);

// Connects, or loads the model.
absl::StatusOr<std::unique_ptr<Backend>> MakeBackend(const BackendArguments& arguments);

}  // namespace stance
