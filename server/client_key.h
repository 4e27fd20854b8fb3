// Who a request comes from, as far as fairness goes.
#pragma once

#include <optional>
#include <string>

namespace stance {

// The caller's own name, cut to 128 bytes, where there is one; otherwise the host of `peer`
// ("ipv4:10.0.0.7:51234" as gRPC writes it), so that all connections from one host count as one client. A
// name never equals a host.
std::string ClientKey(const std::string& peer, const std::optional<std::string>& name);

}  // namespace stance
