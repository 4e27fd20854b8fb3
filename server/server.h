// The server, assembled.
#pragma once

#include <memory>
#include <string>

#include "core/base/status.h"
#include "server/config.h"

namespace stance {

// Owns the networks, the workers, the gRPC server and the metrics page.
class Server {
 public:
  // Loads and warms the networks, then listens, then reports SERVING. Errors name the option at fault.
  // REQUIRES: FinishConfig has passed.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const ServerConfig& config);

  // Drains if Drain was not called.
  virtual ~Server() = default;

  // "HOST:PORT", with the port that was picked if the option's is 0.
  virtual std::string address() const = 0;
  // The same for the metrics page; empty if there is none.
  virtual std::string metrics_address() const = 0;

  // The same for AdminService; empty if there is none.
  virtual std::string admin_address() const = 0;

  // Reads the tokens again, as they are whenever their file changes, and begins to load the models again.
  virtual void Reload() = 0;

  // Reports NOT_SERVING, serves on for the lame-duck time, refuses new requests, finishes every accepted one,
  // and closes. Returns after lame_duck_seconds + drain_timeout_seconds + the longest batch + a reload that
  // runs at the latest, whatever the clients do;
  // true if no accepted request was given up. To be called at most once.
  virtual bool Drain() = 0;
};

}  // namespace stance
