#include "server/client_key.h"

namespace stance {
namespace {

constexpr size_t kMostNameBytes = 128;

}  // namespace

std::string ClientKey(const std::string& peer, const std::optional<std::string>& name) {
  if (name && !name->empty()) return "name:" + name->substr(0, kMostNameBytes);
  const bool has_port = peer.starts_with("ipv4:") || peer.starts_with("ipv6:");
  return has_port ? peer.substr(0, peer.rfind(':')) : peer;
}

}  // namespace stance
