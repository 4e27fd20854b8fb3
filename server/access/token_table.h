// The clients that may call, as their file names them. docs/security.md describes the file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/sha256.h"
#include "core/base/status.h"

namespace stance {

// One client: a plain value.
struct TokenClient {
  std::string name;                           // for logs: letters, digits, "-", "_"
  std::vector<Sha256Digest> tokens;           // at least one; several while one replaces another
  std::optional<double> requests_per_second;  // none: no limit
  std::optional<double> vertices_per_second;
  bool admin = false;  // may call AdminService
};

// A TOML document with one table per client:
//
//   [clients.NAME]
//   token_sha256 = "64 hexadecimal digits"   # or an array of such
//   requests_per_second = 10                 # optional, as is
//   vertices_per_second = 2e6
//   admin = true
//
// INVALID_ARGUMENT, naming the line or the key, never a value, for anything else, for a digest that two
// clients share, and for no client at all.
absl::StatusOr<std::vector<TokenClient>> ParseTokenTable(const std::string& toml);

}  // namespace stance
