// The server's command line.
#pragma once

#include <optional>
#include <variant>

#include "server/config.h"

namespace stance {

// The exit code when there is nothing to serve: after --help and --version, or a wrong command line.
struct ExitNow {
  int code = 0;
};

// Reads the configuration: defaults, then the file of --config, then the environment, then the flags. Prints
// help, version or errors itself.
std::variant<ServerConfig, ExitNow> ReadCommandLine(int argc, char** argv);

}  // namespace stance
