// Certificates that a test makes for itself, with the openssl tool.
#pragma once

#include <filesystem>
#include <string>

namespace stance::testing {

// PEM files.
struct KeyPair {
  std::filesystem::path certificate;
  std::filesystem::path key;
};

// An authority with a new key.
class Authority {
 public:
  // Its files go to `folder`, which must be there and its own.
  explicit Authority(std::filesystem::path folder);

  const std::filesystem::path& certificate() const { return own_.certificate; }

  // A new key and certificate for localhost and 127.0.0.1, as files NAME.pem and NAME.key in the folder.
  KeyPair Issue(const std::string& name) const;

 private:
  const std::filesystem::path folder_;
  const KeyPair own_;
};

}  // namespace stance::testing
