// The file of tokens, kept up to date.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/base/status.h"
#include "server/access/token_gate.h"
#include "server/file_watch.h"
#include "server/metrics.h"

namespace stance {

// Fills a gate from a file, again whenever the file has changed. A file that can't be read or understood
// leaves the clients as they were. Thread-safe.
class TokenFile {
 public:
  // Errors as ParseTokenTable or ReadFile, with the path. The gate and the metrics outlive the result.
  static absl::StatusOr<std::unique_ptr<TokenFile>> Open(const std::string& path, TokenGate& gate,
                                                         Metrics& metrics);

  // Reads the file again; logs and counts how that went, if its text is another than the last time.
  void Reload();

 private:
  TokenFile(std::string path, TokenGate& gate, Metrics& metrics)
      : path_(std::move(path)), gate_(gate), metrics_(metrics) {}

  absl::Status Read(bool* changed);

  const std::string path_;
  TokenGate& gate_;
  Metrics& metrics_;
  std::mutex mutex_;
  std::optional<Sha256Digest> last_;  // the digest of the last text read; protected by mutex_
  std::unique_ptr<FileWatch> watch_;  // destroyed first: it calls Reload
};

}  // namespace stance
