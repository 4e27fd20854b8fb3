#include "tests/support/certificates.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "tests/support/process.h"

namespace stance::testing {
namespace {

// A self-signed certificate, with `more` arguments.
KeyPair Make(const std::filesystem::path& folder, const std::string& name,
             const std::vector<std::string>& more) {
  KeyPair pair{folder / (name + ".pem"), folder / (name + ".key")};
  std::vector<std::string> command = {STANCE_OPENSSL,
                                      "req",
                                      "-x509",
                                      "-newkey",
                                      "ec",
                                      "-pkeyopt",
                                      "ec_paramgen_curve:prime256v1",
                                      "-nodes",
                                      "-days",
                                      "2",
                                      "-subj",
                                      "/CN=" + name,
                                      "-keyout",
                                      pair.key,
                                      "-out",
                                      pair.certificate};
  command.insert(command.end(), more.begin(), more.end());
  const ProgramResult result = RunProgram(command);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return pair;
}

}  // namespace

Authority::Authority(std::filesystem::path folder)
    : folder_(std::move(folder)),
      own_(Make(folder_, "authority", {"-addext", "basicConstraints=critical,CA:TRUE"})) {}

KeyPair Authority::Issue(const std::string& name) const {
  return Make(folder_, name,
              {"-CA", own_.certificate, "-CAkey", own_.key, "-addext", "basicConstraints=critical,CA:FALSE",
               "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"});
}

}  // namespace stance::testing
