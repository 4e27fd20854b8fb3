#include "server/status_map.h"

#include <fmt/format.h>
#include <google/protobuf/message_lite.h>

#include <algorithm>
#include <cctype>

#include "absl/strings/cord.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace stance {
namespace {

constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";
constexpr char kBadRequestUrl[] = "type.googleapis.com/google.rpc.BadRequest";
constexpr char kRetryInfoUrl[] = "type.googleapis.com/google.rpc.RetryInfo";

// A client refuses metadata beyond 8 KiB by default. The text travels up to three times: as the message, in
// google.rpc.Status, and in BadRequest.
constexpr size_t kMaxText = 1000;

// A parser's error may quote the caller's bytes; a proto string must be UTF-8, and a log line one line.
std::string Printable(std::string text) {
  if (text.size() > kMaxText) text = text.substr(0, kMaxText) + "...";
  for (char& c : text) {
    if (c < 0x20 || c > 0x7e) c = '?';
  }
  return text;
}

void Attach(absl::Status& status, const char* url, const google::protobuf::MessageLite& message) {
  status.SetPayload(url, absl::Cord(message.SerializeAsString()));
}

template <typename Message>
std::optional<Message> Attached(const absl::Status& status, const char* url) {
  const auto payload = status.GetPayload(url);
  Message message;
  if (!payload.has_value() || !message.ParseFromString(std::string(*payload))) return std::nullopt;
  return message;
}

absl::Status WithRetry(absl::Status status, std::chrono::milliseconds retry_after) {
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(retry_after.count() / 1000);
  retry.mutable_retry_delay()->set_nanos(static_cast<int32_t>(retry_after.count() % 1000) * 1'000'000);
  Attach(status, kRetryInfoUrl, retry);
  return status;
}

std::string DefaultReason(absl::StatusCode code) { return absl::StatusCodeToString(code); }

// The length of the field path that `text` begins with, or 0: letters, digits, "_", "." and "[]", then ": ".
size_t FieldLength(const std::string& text) {
  const size_t colon = text.find(": ");
  if (colon == std::string::npos || colon == 0) return 0;
  const bool is_path =
      std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(colon), [](char c) {
        return std::islower(static_cast<unsigned char>(c)) || std::isdigit(static_cast<unsigned char>(c)) ||
               c == '_' || c == '.' || c == '[' || c == ']';
      });
  return is_path ? colon : 0;
}

}  // namespace

absl::Status WithReason(absl::Status status, const std::string& reason,
                        const std::map<std::string, std::string>& metadata) {
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  info.set_domain(kErrorDomain);
  for (const auto& [key, value] : metadata) (*info.mutable_metadata())[key] = value;
  Attach(status, kErrorInfoUrl, info);
  return status;
}

absl::Status FieldError(absl::StatusCode code, const std::string& reason, const std::string& field,
                        const std::string& description) {
  absl::Status status =
      WithReason(absl::Status(code, Printable(fmt::format("{}: {}", field, description))), reason);
  google::rpc::BadRequest bad_request;
  auto* violation = bad_request.add_field_violations();
  violation->set_field(field);
  violation->set_description(Printable(description));
  Attach(status, kBadRequestUrl, bad_request);
  return status;
}

absl::Status NameField(const absl::Status& status, const std::string& reason, const std::string& parent) {
  if (status.ok()) return status;
  const std::string text(status.message());
  const size_t length = FieldLength(text);
  std::string field = parent;
  if (length > 0) {
    if (!field.empty()) field += '.';
    field += text.substr(0, length);
  }
  return FieldError(status.code(), reason, field, length > 0 ? text.substr(length + 2) : text);
}

absl::Status OverloadError(const std::string& reason, const std::string& message,
                           std::chrono::milliseconds retry_after) {
  return WithRetry(WithReason(absl::UnavailableError(message), reason), retry_after);
}

absl::Status ShuttingDownError() {
  return OverloadError("SHUTTING_DOWN", "the server is shutting down", std::chrono::seconds(1));
}

absl::Status QuotaError(const std::string& reason, const std::string& message,
                        std::chrono::milliseconds retry_after) {
  return WithRetry(WithReason(absl::ResourceExhaustedError(message), reason), retry_after);
}

std::string ReasonOf(const absl::Status& status) {
  if (status.ok()) return "";
  const auto info = Attached<google::rpc::ErrorInfo>(status, kErrorInfoUrl);
  return info ? info->reason() : DefaultReason(status.code());
}

std::optional<std::chrono::milliseconds> RetryPushback(const absl::Status& status) {
  const auto retry = Attached<google::rpc::RetryInfo>(status, kRetryInfoUrl);
  if (!retry) return std::nullopt;
  return std::chrono::milliseconds(retry->retry_delay().seconds() * 1000 +
                                   retry->retry_delay().nanos() / 1'000'000);
}

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const absl::Status complete = status.GetPayload(kErrorInfoUrl).has_value()
                                    ? status
                                    : WithReason(status, DefaultReason(status.code()));
  // absl::StatusCode and grpc::StatusCode share their numbers, those of google.rpc.Code; an absl code outside
  // that range comes out as UNKNOWN.
  const int code = static_cast<int>(complete.code());
  google::rpc::Status wire;
  wire.set_code(code);
  wire.set_message(Printable(std::string(complete.message())));
  // In this order, whatever the order of the payloads.
  for (const char* url : {kErrorInfoUrl, kBadRequestUrl, kRetryInfoUrl}) {
    const auto payload = complete.GetPayload(url);
    if (!payload.has_value()) continue;
    auto* detail = wire.add_details();
    detail->set_type_url(url);
    detail->set_value(std::string(*payload));
  }
  return grpc::Status(static_cast<grpc::StatusCode>(code), wire.message(), wire.SerializeAsString());
}

}  // namespace stance
