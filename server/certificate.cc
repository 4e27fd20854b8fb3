#include "server/certificate.h"

#include <openssl/asn1.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <ctime>
#include <memory>

namespace stance {
namespace {

struct Free {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};

std::unique_ptr<BIO, Free> Reader(const std::string& text) {
  return std::unique_ptr<BIO, Free>(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// Nobody is there to be asked for a passphrase.
int NoPassphrase(char*, int, int, void*) { return -1; }

std::unique_ptr<X509, Free> FirstCertificate(const std::string& chain) {
  const auto reader = Reader(chain);
  std::unique_ptr<X509, Free> certificate(PEM_read_bio_X509(reader.get(), nullptr, NoPassphrase, nullptr));
  ERR_clear_error();
  return certificate;
}

}  // namespace

absl::Status CheckKeyPair(const std::string& chain, const std::string& key) {
  const auto certificate = FirstCertificate(chain);
  if (certificate == nullptr) return absl::InvalidArgumentError("the certificate is not PEM");
  const auto reader = Reader(key);
  const std::unique_ptr<EVP_PKEY, Free> parsed(
      PEM_read_bio_PrivateKey(reader.get(), nullptr, NoPassphrase, nullptr));
  const bool fits = parsed != nullptr && X509_check_private_key(certificate.get(), parsed.get()) == 1;
  ERR_clear_error();
  if (parsed == nullptr) return absl::InvalidArgumentError("the key is not PEM without a passphrase");
  if (!fits) return absl::InvalidArgumentError("the key is not the certificate's");
  return absl::OkStatus();
}

absl::StatusOr<double> CertificateExpiry(const std::string& chain) {
  const auto certificate = FirstCertificate(chain);
  std::tm time{};
  if (certificate == nullptr || ASN1_TIME_to_tm(X509_get0_notAfter(certificate.get()), &time) != 1) {
    return absl::InvalidArgumentError("the certificate is not PEM");
  }
  return static_cast<double>(timegm(&time));
}

}  // namespace stance
