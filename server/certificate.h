// Certificates and keys in PEM, checked before they are served.
#pragma once

#include <string>

#include "core/base/status.h"

namespace stance {

// INVALID_ARGUMENT, saying which of the two is wrong and never what it holds, unless `chain` begins with a
// certificate and `key` is its private key, without a passphrase.
absl::Status CheckKeyPair(const std::string& chain, const std::string& key);

// When the first certificate of `chain` expires, seconds since 1970. INVALID_ARGUMENT if there is none.
absl::StatusOr<double> CertificateExpiry(const std::string& chain);

}  // namespace stance
