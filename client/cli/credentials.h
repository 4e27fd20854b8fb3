// The options of every tool that say how it meets a server: encryption and token.
#pragma once

#include <string>

#include "client/channel.h"
#include "core/base/status.h"

namespace CLI {
class App;
}

namespace stance {

struct CredentialArguments {
  bool tls = false;
  // PEM files; each implies TLS, as does `server_name`.
  std::string ca;
  std::string certificate;
  std::string key;
  std::string server_name;
  std::string token_file;
};

// Adds --tls, --tls-ca, --tls-cert, --tls-key, --tls-name and --token-file. There is no option for the token
// itself: everyone on a machine can read the command lines of its processes.
void AddCredentials(CLI::App* app, CredentialArguments* arguments);

// Reads the files, and the token where no file is named from $STANCE_TOKEN_FILE or $STANCE_TOKEN. Errors
// carry their exit code and never a file's content.
absl::Status ReadCredentials(const CredentialArguments& arguments, ClientOptions* options);

}  // namespace stance
