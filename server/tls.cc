#include "server/tls.h"

#include <fmt/format.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <string>

#include "core/base/files.h"
#include "server/certificate.h"

namespace stance {
namespace {

absl::StatusOr<std::string> ReadOption(const char* option, const std::string& path) {
  absl::StatusOr<std::string> text = ReadFile(path);
  if (!text.ok()) {
    return absl::Status(text.status().code(),
                        fmt::format("{}: {}", option, std::string(text.status().message())));
  }
  return text;
}

// gRPC reads the files itself, and of bad ones says no more than a line on standard error.
absl::Status CheckFiles(const ServerConfig& config) {
  STANCE_ASSIGN_OR_RETURN(const std::string chain, ReadOption("tls.certificate", config.tls_certificate));
  STANCE_ASSIGN_OR_RETURN(const std::string key, ReadOption("tls.key", config.tls_key));
  const absl::Status pair = CheckKeyPair(chain, key);
  if (!pair.ok()) {
    return absl::InvalidArgumentError(fmt::format("tls.certificate: {}, tls.key: {}: {}",
                                                  config.tls_certificate, config.tls_key,
                                                  std::string(pair.message())));
  }
  if (config.tls_client_ca.empty()) return absl::OkStatus();
  STANCE_ASSIGN_OR_RETURN(const std::string ca, ReadOption("tls.client_ca", config.tls_client_ca));
  if (!CertificateExpiry(ca).ok()) {
    return absl::InvalidArgumentError(
        fmt::format("tls.client_ca: {}: holds no certificate in PEM", config.tls_client_ca));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeServerCredentials(const ServerConfig& config) {
  if (config.tls_certificate.empty()) return grpc::InsecureServerCredentials();
  STANCE_RETURN_IF_ERROR(CheckFiles(config));
  grpc::experimental::TlsServerCredentialsOptions options(
      std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
          config.tls_key, config.tls_certificate, config.tls_client_ca,
          static_cast<unsigned int>(config.tls_reload_seconds)));
  options.watch_identity_key_cert_pairs();
  if (!config.tls_client_ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace stance
