#include "client/cli/exit_code.h"

#include <fmt/format.h>

#include <optional>
#include <string>

#include "absl/strings/cord.h"

namespace stance {
namespace {

constexpr char kPayload[] = "stance.exit_code";

absl::Status WithExitCode(absl::Status status, ExitCode code) {
  if (!status.ok()) status.SetPayload(kPayload, absl::Cord(std::to_string(static_cast<int>(code))));
  return status;
}

ExitCode ByStatusCode(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:
      return ExitCode::kOk;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kUnimplemented:
      return ExitCode::kBadInput;
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kDataLoss:
      return ExitCode::kFile;
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kDeadlineExceeded:
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kCancelled:
    case absl::StatusCode::kAborted:
    case absl::StatusCode::kUnauthenticated:
      return ExitCode::kServer;
    default:
      return ExitCode::kInternal;
  }
}

}  // namespace

ExitCode ExitCodeFor(const absl::Status& status) {
  if (const auto payload = status.GetPayload(kPayload)) {
    return static_cast<ExitCode>(std::stoi(std::string(*payload)));
  }
  return ByStatusCode(status.code());
}

absl::Status UsageError(const absl::Status& status) { return WithExitCode(status, ExitCode::kUsage); }

absl::Status FileError(const absl::Status& status) {
  return WithExitCode(
      status, status.code() == absl::StatusCode::kInvalidArgument ? ExitCode::kBadInput : ExitCode::kFile);
}

absl::Status ServerError(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
      return WithExitCode(status, ExitCode::kBadInput);
    case absl::StatusCode::kPermissionDenied:
      return WithExitCode(status, ExitCode::kServer);
    case absl::StatusCode::kDataLoss:
      return WithExitCode(status, ExitCode::kInternal);
    default:
      return status;
  }
}

absl::Status UnsureError(const absl::Status& status) { return WithExitCode(status, ExitCode::kUnsure); }

std::string ErrorLine(const std::string& program, const absl::Status& status) {
  std::string text(status.message());
  if (text.empty()) text = absl::StatusCodeToString(status.code());
  for (char& c : text) {
    if (c == '\n' || c == '\r' || c == '\t') c = ' ';
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return fmt::format("{}: {}\n", program, text);
}

}  // namespace stance
