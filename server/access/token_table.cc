#include "server/access/token_table.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace stance {
namespace {

// A million times what one machine serves: larger numbers are slips.
constexpr double kMostPerSecond = 1e12;
constexpr size_t kMostNameLength = 64;

absl::Status Bad(const std::string& key, const std::string& want) {
  return absl::InvalidArgumentError(fmt::format("{}: want {}", key, want));
}

bool IsName(const std::string& text) {
  return !text.empty() && text.size() <= kMostNameLength && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  });
}

std::optional<uint8_t> HexDigit(char c) {
  if (c >= '0' && c <= '9') return static_cast<uint8_t>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<uint8_t>(c - 'a' + 10);
  if (c >= 'A' && c <= 'F') return static_cast<uint8_t>(c - 'A' + 10);
  return std::nullopt;
}

absl::StatusOr<Sha256Digest> DigestOf(const toml::node& node, const std::string& key) {
  // The value stays out of the text: it may be a token that was put here by mistake.
  const absl::Status bad = Bad(key, "64 hexadecimal digits, the SHA-256 of a token");
  const auto* text = node.as_string();
  Sha256Digest digest{};
  if (text == nullptr || text->get().size() != 2 * digest.size()) return bad;
  for (size_t i = 0; i < digest.size(); ++i) {
    const auto high = HexDigit(text->get()[2 * i]), low = HexDigit(text->get()[2 * i + 1]);
    if (!high || !low) return bad;
    digest[i] = static_cast<uint8_t>(*high << 4 | *low);
  }
  if (digest == Sha256("")) return Bad(key, "the SHA-256 of a token, not of nothing");
  return digest;
}

absl::StatusOr<std::vector<Sha256Digest>> DigestsOf(const toml::node& node, const std::string& key) {
  std::vector<Sha256Digest> digests;
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& element : *array) {
      STANCE_ASSIGN_OR_RETURN(digests.emplace_back(), DigestOf(element, key));
    }
  } else {
    STANCE_ASSIGN_OR_RETURN(digests.emplace_back(), DigestOf(node, key));
  }
  return digests;
}

absl::StatusOr<double> RateOf(const toml::node& node, const std::string& key) {
  const std::optional<double> rate = node.value<double>();
  const bool number = node.is_integer() || node.is_floating_point();
  // Written so that a NaN is refused too.
  if (!number || !rate || !(*rate > 0 && *rate <= kMostPerSecond)) {
    return Bad(key, fmt::format("a number above 0, at most {:g}", kMostPerSecond));
  }
  return *rate;
}

absl::StatusOr<TokenClient> ClientOf(const std::string& name, const toml::node& node) {
  const std::string prefix = "clients." + name;
  const toml::table* entries = node.as_table();
  if (entries == nullptr) return Bad(prefix, "a table");
  TokenClient client;
  client.name = name;
  for (const auto& [entry, value] : *entries) {
    const std::string key = fmt::format("{}.{}", prefix, std::string(entry.str()));
    if (entry.str() == "token_sha256") {
      STANCE_ASSIGN_OR_RETURN(client.tokens, DigestsOf(value, key));
    } else if (entry.str() == "requests_per_second") {
      STANCE_ASSIGN_OR_RETURN(client.requests_per_second, RateOf(value, key));
    } else if (entry.str() == "vertices_per_second") {
      STANCE_ASSIGN_OR_RETURN(client.vertices_per_second, RateOf(value, key));
    } else if (entry.str() == "admin") {
      if (!value.is_boolean()) return Bad(key, "true or false");
      client.admin = value.as_boolean()->get();
    } else {
      return absl::InvalidArgumentError(fmt::format("{}: an unknown key", prefix));
    }
  }
  if (client.tokens.empty()) return Bad(prefix, "token_sha256");
  return client;
}

}  // namespace

absl::StatusOr<std::vector<TokenClient>> ParseTokenTable(const std::string& text) {
  toml::table document;
  try {
    document = toml::parse(text);
  } catch (const toml::parse_error& error) {
    // Without its description, which may quote the line.
    return absl::InvalidArgumentError(fmt::format("line {}: not TOML", error.source().begin.line));
  }
  std::vector<TokenClient> clients;
  std::set<Sha256Digest> seen;
  for (const auto& [section, node] : document) {
    const toml::table* tables = node.as_table();
    if (section.str() != "clients" || tables == nullptr) {
      return absl::InvalidArgumentError("want nothing but tables [clients.NAME]");
    }
    for (const auto& [key, client] : *tables) {
      const std::string name(key.str());
      if (!IsName(name)) {
        return Bad(fmt::format("client {}", clients.size() + 1),
                   fmt::format("a name of at most {} letters, digits, \"-\" and \"_\"", kMostNameLength));
      }
      STANCE_ASSIGN_OR_RETURN(clients.emplace_back(), ClientOf(name, client));
      for (const Sha256Digest& digest : clients.back().tokens) {
        if (!seen.insert(digest).second) {
          return Bad(fmt::format("clients.{}.token_sha256", name), "a token that is not there twice");
        }
      }
    }
  }
  if (clients.empty()) return absl::InvalidArgumentError("want at least one table [clients.NAME]");
  return clients;
}

}  // namespace stance
