// Runs the project's own programs as their users do.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace stance::testing {

struct ProgramResult {
  int exit_code = -1;  // 128 + the signal, if one ended it
  std::string out;
  std::string err;
};

// Runs `command` (program and arguments, no shell) to its end, with the test's environment.
ProgramResult RunProgram(const std::vector<std::string>& command);

// A program in the background. Not thread-safe.
class BackgroundProgram {
 public:
  // Its stdout can be read line by line; its stderr goes to the file.
  BackgroundProgram(const std::vector<std::string>& command, const std::string& stderr_file);
  BackgroundProgram(const BackgroundProgram&) = delete;
  BackgroundProgram& operator=(const BackgroundProgram&) = delete;
  // Kills what still runs.
  ~BackgroundProgram();

  // The next line of its stdout, waiting for it; empty at the end of the stream.
  std::string ReadLine();

  void Signal(int signal) const;

  // Waits for its end: its exit code, or 128 + the signal.
  int Wait();

  pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
  int stdout_ = -1;
  bool waited_ = false;
  int exit_code_ = -1;
};

}  // namespace stance::testing
