#include "server/call_metadata.h"

#include <fmt/format.h>

#include <chrono>
#include <iterator>

#include "server/status_map.h"

namespace stance {
namespace {

absl::Status StatusOf(const Admission& admission) {
  const auto over_quota = [&](const char* reason, const char* what) {
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(admission.retry_after);
    return QuotaError(reason,
                      fmt::format("client {} is over its quota of {} per second; try again in {} ms",
                                  admission.client, what, wait.count()),
                      wait);
  };
  switch (admission.verdict) {
    case Admission::Verdict::kAdmitted:
      break;
    case Admission::Verdict::kNoToken:
      return WithReason(
          absl::UnauthenticatedError("want the metadata \"authorization\", once, as \"Bearer TOKEN\""),
          "TOKEN_MISSING");
    case Admission::Verdict::kUnknownToken:
      return WithReason(absl::UnauthenticatedError("the token is no client's"), "TOKEN_UNKNOWN");
    case Admission::Verdict::kRequests:
      return over_quota("REQUEST_QUOTA", "requests");
    case Admission::Verdict::kVertices:
      return over_quota("VERTEX_QUOTA", "vertices");
  }
  return absl::OkStatus();
}

}  // namespace

std::optional<std::string> OnlyMetadata(const grpc::ServerContextBase& context, const std::string& name) {
  const auto [first, last] = context.client_metadata().equal_range(name);
  if (first == last || std::next(first) != last) return std::nullopt;
  return std::string(first->second.data(), first->second.size());
}

TraceContext BeginSpan(const grpc::ServerContextBase& context) {
  const std::optional<std::string> header = OnlyMetadata(context, "traceparent");
  return BeginSpan(header ? ParseTraceparent(*header) : std::nullopt);
}

absl::Status CheckAccess(TokenGate& gate, const grpc::ServerContextBase& context, int64_t vertices,
                         TimePoint now, std::string* client) {
  const Admission admission = gate.Admit(OnlyMetadata(context, "authorization"), vertices, now);
  *client = admission.client;
  return StatusOf(admission);
}

absl::Status CheckAdmin(TokenGate& gate, const grpc::ServerContextBase& context, TimePoint now,
                        std::string* client) {
  const Admission admission = gate.Admit(OnlyMetadata(context, "authorization"), 0, now);
  *client = admission.client;
  STANCE_RETURN_IF_ERROR(StatusOf(admission));
  if (admission.admin) return absl::OkStatus();
  return WithReason(
      absl::PermissionDeniedError(fmt::format("client {} may not administer the server", admission.client)),
      "NOT_ADMIN");
}

void AddAnswerMetadata(grpc::ServerContextBase& context, const TraceContext& span,
                       const absl::Status& status) {
  context.AddTrailingMetadata("traceresponse", FormatTraceparent(span));
  if (const auto pushback = RetryPushback(status)) {
    context.AddTrailingMetadata("grpc-retry-pushback-ms", fmt::format("{}", pushback->count()));
  }
}

}  // namespace stance
