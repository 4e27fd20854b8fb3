#include "server/token_file.h"

#include <fmt/format.h>

#include <utility>

#include "core/base/files.h"
#include "server/log.h"

namespace stance {

absl::StatusOr<std::unique_ptr<TokenFile>> TokenFile::Open(const std::string& path, TokenGate& gate,
                                                           Metrics& metrics) {
  std::unique_ptr<TokenFile> file(new TokenFile(path, gate, metrics));
  bool changed = false;
  STANCE_RETURN_IF_ERROR(file->Read(&changed));
  metrics.CountTokenReload(true);
  auto watch = FileWatch::Start(path, [file = file.get()] { file->Reload(); });
  if (watch.ok()) {
    file->watch_ = *std::move(watch);
    file->Reload();  // what changed before it was watched
  } else {
    Log(LogLevel::kWarn, "tokens not watched", {{"error", std::string(watch.status().message())}});
  }
  return file;
}

void TokenFile::Reload() {
  bool changed = false;
  const absl::Status status = Read(&changed);
  if (!changed) return;
  metrics_.CountTokenReload(status.ok());
  if (status.ok()) {
    Log(LogLevel::kInfo, "tokens reloaded", {{"file", path_}});
  } else {
    Log(LogLevel::kError, "tokens not reloaded", {{"error", std::string(status.message())}});
  }
}

absl::Status TokenFile::Read(bool* changed) {
  std::lock_guard<std::mutex> guard(mutex_);
  const absl::StatusOr<std::string> text = ReadFile(path_);
  const Sha256Digest digest = Sha256(text.ok() ? *text : std::string(text.status().message()));
  *changed = last_ != digest;
  if (!*changed) return absl::OkStatus();
  last_ = digest;
  if (!text.ok()) return text.status();
  absl::StatusOr<std::vector<TokenClient>> clients = ParseTokenTable(*text);
  if (!clients.ok()) {
    return absl::Status(clients.status().code(),
                        fmt::format("{}: {}", path_, std::string(clients.status().message())));
  }
  gate_.Replace(*std::move(clients));
  return absl::OkStatus();
}

}  // namespace stance
