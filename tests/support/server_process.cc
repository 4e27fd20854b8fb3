#include "tests/support/server_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace stance::testing {

ServerProcess::ServerProcess(const std::vector<std::string>& arguments, const std::string& model) {
  static int count = 0;
  log_file_ = ::testing::TempDir() + "stance-server-" + std::to_string(getpid()) + "-" +
              std::to_string(++count) + ".log";
  // Nobody waits for a load balancer here, so the pause before a drain is left out.
  std::vector<std::string> command = {STANCE_SERVER_BINARY,
                                      "--listen",
                                      "127.0.0.1:0",
                                      "--metrics-listen",
                                      "127.0.0.1:0",
                                      "--model",
                                      model,
                                      "--server-lame-duck-seconds",
                                      "0"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  // Many a test sends a mesh again because it takes long. A flag goes before this.
  setenv("STANCE_INFERENCE_RIG_CACHE_BYTES", "0", /*overwrite=*/0);
  program_ = std::make_unique<BackgroundProgram>(command, log_file_);
  const std::string prefix = "listening on ";
  const std::string line = program_->ReadLine();
  if (line.starts_with(prefix)) {
    address_ = line.substr(prefix.size());
  } else {
    // Not a failure of GoogleTest's: in the set-up of a suite that marks its tests as skipped, and ctest lets
    // skipped tests pass.
    std::fprintf(stderr, "the server did not start: %s\n", Log().c_str());
    std::abort();
  }
}

std::string ServerProcess::Log() const {
  std::ifstream stream(log_file_);
  return {std::istreambuf_iterator<char>(stream), {}};
}

int ServerProcess::Stop() {
  program_->Signal(SIGTERM);
  return program_->Wait();
}

}  // namespace stance::testing
