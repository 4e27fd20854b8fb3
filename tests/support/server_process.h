// A real stance-server for a test, on a port of its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace stance::testing {

class ServerProcess {
 public:
  // Starts the built server with `model`, by default the untrained one, and no rig cache on a free port of
  // the loopback interface and waits until it listens. `arguments` come after those, e.g.
  // {"--batching-max-queued-requests", "1"}.
  explicit ServerProcess(const std::vector<std::string>& arguments = {},
                         const std::string& model = STANCE_UNTRAINED_MODEL);

  // HOST:PORT; empty if it did not start.
  const std::string& address() const { return address_; }

  // Its log so far.
  std::string Log() const;

  void Signal(int signal) const { program_->Signal(signal); }

  // Asks it to drain (SIGTERM), waits, and answers its exit code.
  int Stop();

 private:
  std::string log_file_;
  std::unique_ptr<BackgroundProgram> program_;
  std::string address_;
};

}  // namespace stance::testing
