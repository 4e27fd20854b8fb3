#include "server/access/token_gate.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <cctype>
#include <utility>

namespace stance {
namespace {

// The token of "Bearer TOKEN" (RFC 6750, 2.1; the scheme's case does not matter: RFC 9110, 11.1).
std::optional<std::string> BearerToken(const std::string& authorization) {
  const std::string scheme = "bearer ";
  if (authorization.size() <= scheme.size()) return std::nullopt;
  const bool bearer = std::equal(scheme.begin(), scheme.end(), authorization.begin(), [](char want, char c) {
    return want == std::tolower(static_cast<unsigned char>(c));
  });
  if (!bearer) return std::nullopt;
  return authorization.substr(scheme.size());
}

std::optional<TokenBucket> BucketFor(const std::optional<double>& rate) {
  if (!rate) return std::nullopt;
  return TokenBucket(*rate);
}

Duration WaitFor(const std::optional<TokenBucket>& bucket, double units, TimePoint now) {
  return bucket ? bucket->WaitFor(units, now) : Duration::zero();
}

}  // namespace

void TokenGate::Replace(std::vector<TokenClient> clients) {
  std::vector<Account> accounts;
  for (TokenClient& client : clients) {
    const auto requests = BucketFor(client.requests_per_second);
    const auto vertices = BucketFor(client.vertices_per_second);
    accounts.push_back({std::move(client), requests, vertices});
  }
  std::lock_guard<std::mutex> guard(mutex_);
  for (Account& account : accounts) {
    for (const Account& old : accounts_) {
      if (old.client.name != account.client.name) continue;
      if (old.client.requests_per_second == account.client.requests_per_second) {
        account.requests = old.requests;
      }
      if (old.client.vertices_per_second == account.client.vertices_per_second) {
        account.vertices = old.vertices;
      }
    }
  }
  accounts_ = std::move(accounts);
  open_ = false;
}

Admission TokenGate::Admit(const std::optional<std::string>& authorization, int64_t vertices, TimePoint now) {
  using Verdict = Admission::Verdict;
  const std::optional<std::string> token = authorization ? BearerToken(*authorization) : std::nullopt;
  const Sha256Digest digest = Sha256(token.value_or(""));
  std::lock_guard<std::mutex> guard(mutex_);
  if (open_) return {};
  if (!token) return {.verdict = Verdict::kNoToken, .client = "", .admin = false, .retry_after = {}};
  Account* const account = FindLocked(digest);
  if (account == nullptr)
    return {.verdict = Verdict::kUnknownToken, .client = "", .admin = false, .retry_after = {}};
  const auto size = static_cast<double>(vertices);
  const Duration for_requests = WaitFor(account->requests, 1, now);
  // What has none waits for none, whoever has had more than a second's worth before.
  const Duration for_vertices = vertices > 0 ? WaitFor(account->vertices, size, now) : Duration::zero();
  Admission admission;
  admission.client = account->client.name;
  admission.admin = account->client.admin;
  admission.retry_after = std::max(for_requests, for_vertices);
  if (admission.retry_after > Duration::zero()) {
    admission.verdict = for_requests >= for_vertices ? Verdict::kRequests : Verdict::kVertices;
    return admission;
  }
  if (account->requests) account->requests->Take(1, now);
  if (account->vertices) account->vertices->Take(size, now);
  return admission;
}

TokenGate::Account* TokenGate::FindLocked(const Sha256Digest& digest) {
  Account* found = nullptr;
  // To the end, whichever it is.
  for (Account& account : accounts_) {
    for (const Sha256Digest& known : account.client.tokens) {
      if (CRYPTO_memcmp(known.data(), digest.data(), digest.size()) == 0) found = &account;
    }
  }
  return found;
}

}  // namespace stance
