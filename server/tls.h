// What the server's port asks of a connection.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "core/base/status.h"
#include "server/config.h"

namespace stance {

// TLS with the files that `config` names, which are read again when they change; with `tls.client_ca` only
// for clients that have a certificate from it. Without `tls.certificate` no encryption. Errors name the
// option at fault. REQUIRES: FinishConfig has passed.
absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeServerCredentials(const ServerConfig& config);

}  // namespace stance
