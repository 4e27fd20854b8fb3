// Errors on their way to the caller: absl::Status within the server, google.rpc.Status on the wire.
//
// The details of an error travel as payloads of its absl::Status, so that every function keeps returning
// plain statuses and one function, ToGrpcStatus, knows the wire.
#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "core/base/status.h"

namespace stance {

// The domain of every reason (google.rpc.ErrorInfo).
inline constexpr char kErrorDomain[] = "stance";

// `status` with ErrorInfo: why, for a program. `reason` is UPPER_SNAKE_CASE.
absl::Status WithReason(absl::Status status, const std::string& reason,
                        const std::map<std::string, std::string>& metadata = {});

// An error of one field of the request, e.g. "source.arrays.positions": text "FIELD: DESCRIPTION", ErrorInfo
// and BadRequest.
absl::Status FieldError(absl::StatusCode code, const std::string& reason, const std::string& field,
                        const std::string& description);

// A status from below whose text begins with the field it is about ("arrays.positions: 13 bytes ...") as a
// FieldError of `parent` + "." + that field, or of `parent` itself if the text names no field. An empty
// parent stands for the request.
absl::Status NameField(const absl::Status& status, const std::string& reason, const std::string& parent);

// A passing overload: UNAVAILABLE with ErrorInfo and RetryInfo.
absl::Status OverloadError(const std::string& reason, const std::string& message,
                           std::chrono::milliseconds retry_after);

// The overload of a server that ends: the caller's next try should reach another, or its successor.
absl::Status ShuttingDownError();

// More than one caller's share: RESOURCE_EXHAUSTED, otherwise as above.
absl::Status QuotaError(const std::string& reason, const std::string& message,
                        std::chrono::milliseconds retry_after);

// The ErrorInfo reason: the one attached, or one that stands for the code ("INTERNAL"). Empty for OK.
std::string ReasonOf(const absl::Status& status);

// How long the caller should wait before it tries again: what to send as `grpc-retry-pushback-ms`.
std::optional<std::chrono::milliseconds> RetryPushback(const absl::Status& status);

// The status for the wire, with google.rpc.Status in its details. Every error carries ErrorInfo. Text is cut
// to a size that fits gRPC's metadata limit, and bytes that are not printable ASCII are replaced.
grpc::Status ToGrpcStatus(const absl::Status& status);

}  // namespace stance
