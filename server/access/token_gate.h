// Who may call, and how much.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "server/access/token_bucket.h"
#include "server/access/token_table.h"

namespace stance {

// What a gate says to one call.
struct Admission {
  enum class Verdict {
    kAdmitted,
    kNoToken,       // there is none, or not in the form "Bearer TOKEN"
    kUnknownToken,  // no client has it
    kRequests,      // over the client's quota of requests
    kVertices,      // over its quota of vertices
  };
  Verdict verdict = Verdict::kAdmitted;
  std::string client;      // its name; empty if it is not known
  bool admin = true;       // may administer, as anyone may where there are no tokens
  Duration retry_after{};  // over quota: when the same call would be admitted
};

// Compares the SHA-256 of the token that a call brings with those of every client, in a time that does not
// depend on them, and charges the client's quotas. A call that is refused is charged nothing; one that is
// admitted and fails later is. Open to everyone until Replace is called. Thread-safe.
class TokenGate {
 public:
  // The clients from now on. One that had the same name and rates before keeps what it has used.
  void Replace(std::vector<TokenClient> clients);

  // `authorization`: the value of that metadata, if there is one.
  Admission Admit(const std::optional<std::string>& authorization, int64_t vertices, TimePoint now);

 private:
  struct Account {
    TokenClient client;
    std::optional<TokenBucket> requests;
    std::optional<TokenBucket> vertices;
  };

  Account* FindLocked(const Sha256Digest& digest);

  std::mutex mutex_;
  bool open_ = true;  // protected by mutex_, as are the accounts
  std::vector<Account> accounts_;
};

}  // namespace stance
