// What a call's metadata says besides the request.
#pragma once

#include <grpcpp/server_context.h>

#include <optional>
#include <string>

#include "core/base/clock.h"
#include "core/base/status.h"
#include "server/access/token_gate.h"
#include "server/trace_context.h"

namespace stance {

// The value of the only entry called `name` (lower case); nothing if there is none, or more than one.
std::optional<std::string> OnlyMetadata(const grpc::ServerContextBase& context, const std::string& name);

// A new span for the call, in its caller's trace if its traceparent is well-formed.
TraceContext BeginSpan(const grpc::ServerContextBase& context);

// Asks the gate about the call's `authorization`: the client's name, empty where anyone may call.
// UNAUTHENTICATED (TOKEN_MISSING, TOKEN_UNKNOWN), or RESOURCE_EXHAUSTED with the time after which to try
// again (REQUEST_QUOTA, VERTEX_QUOTA), and then `client` is set all the same.
absl::Status CheckAccess(TokenGate& gate, const grpc::ServerContextBase& context, int64_t vertices,
                         TimePoint now, std::string* client);

// The same for a call that administers the server, which only clients that may are let do: otherwise
// PERMISSION_DENIED (NOT_ADMIN).
absl::Status CheckAdmin(TokenGate& gate, const grpc::ServerContextBase& context, TimePoint now,
                        std::string* client);

// What every answer carries in its trailing metadata: `traceresponse`, the call's span in the form of a
// traceparent, so that a caller without tracing can still name the trace; and how long to wait before the
// next try if `status` says so (`grpc-retry-pushback-ms`).
void AddAnswerMetadata(grpc::ServerContextBase& context, const TraceContext& span,
                       const absl::Status& status);

}  // namespace stance
