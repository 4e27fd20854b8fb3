#include "client/cli/credentials.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "client/cli/exit_code.h"
#include "core/base/files.h"

namespace stance {
namespace {

std::string Environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

absl::Status ReadInto(const std::string& path, std::string* text) {
  if (path.empty()) return absl::OkStatus();
  absl::StatusOr<std::string> content = ReadFile(path);
  if (!content.ok()) return FileError(content.status());
  *text = *std::move(content);
  return absl::OkStatus();
}

// A file ends with a line feed, a token does not.
std::string Trimmed(const std::string& text) {
  constexpr char kSpace[] = " \t\r\n";
  const size_t first = text.find_first_not_of(kSpace);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

absl::Status ReadToken(const std::string& option, std::string* token) {
  const std::string path = option.empty() ? Environment("STANCE_TOKEN_FILE") : option;
  std::string text = Environment("STANCE_TOKEN");
  const std::string source = path.empty() ? "$STANCE_TOKEN" : path;
  STANCE_RETURN_IF_ERROR(ReadInto(path, &text));
  *token = Trimmed(text);
  const bool printable =
      std::all_of(token->begin(), token->end(), [](char c) { return c > 0x20 && c < 0x7f; });
  if (!printable || (token->empty() && !path.empty())) {
    return FileError(absl::InvalidArgumentError(
        fmt::format("{}: not a token: want printable ASCII without spaces", source)));
  }
  return absl::OkStatus();
}

}  // namespace

void AddCredentials(CLI::App* app, CredentialArguments* arguments) {
  app->add_flag("--tls", arguments->tls, "Encrypt the connection; implied by the other --tls options");
  app->add_option("--tls-ca", arguments->ca, "Authorities of the server's certificate; default: the system's")
      ->type_name("FILE.pem");
  app->add_option("--tls-cert", arguments->certificate, "The client's own certificate, for mutual TLS")
      ->type_name("FILE.pem");
  app->add_option("--tls-key", arguments->key, "Its private key")->type_name("FILE.pem");
  app->add_option("--tls-name", arguments->server_name, "The name in the server's certificate, if another")
      ->type_name("NAME");
  app->add_option("--token-file", arguments->token_file,
                  "File of the bearer token; default $STANCE_TOKEN_FILE, or the token in $STANCE_TOKEN")
      ->type_name("FILE");
}

absl::Status ReadCredentials(const CredentialArguments& arguments, ClientOptions* options) {
  if (arguments.certificate.empty() != arguments.key.empty()) {
    return UsageError(absl::InvalidArgumentError("--tls-cert, --tls-key: want both or neither"));
  }
  if (arguments.tls || !arguments.ca.empty() || !arguments.certificate.empty() ||
      !arguments.server_name.empty()) {
    ClientTls tls;
    STANCE_RETURN_IF_ERROR(ReadInto(arguments.ca, &tls.authorities));
    STANCE_RETURN_IF_ERROR(ReadInto(arguments.certificate, &tls.certificate));
    STANCE_RETURN_IF_ERROR(ReadInto(arguments.key, &tls.key));
    tls.server_name = arguments.server_name;
    options->tls = std::move(tls);
  }
  STANCE_RETURN_IF_ERROR(ReadToken(arguments.token_file, &options->token));
  return UsageError(CheckCredentials(*options));
}

}  // namespace stance
