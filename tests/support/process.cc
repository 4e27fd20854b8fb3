#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "core/base/check.h"

extern char** environ;

namespace stance::testing {
namespace {

struct Pipe {
  Pipe() {
    int ends[2];
    // Close-on-exec: another child must not hold the writing end open.
    STANCE_CHECK(pipe2(ends, O_CLOEXEC) == 0);
    read_end = ends[0];
    write_end = ends[1];
  }
  int read_end;
  int write_end;
};

pid_t Spawn(const std::vector<std::string>& command, int out, int err) {
  posix_spawn_file_actions_t actions;
  STANCE_CHECK(posix_spawn_file_actions_init(&actions) == 0);
  STANCE_CHECK(posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO) == 0);
  STANCE_CHECK(posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO) == 0);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t pid = -1;
  STANCE_CHECK(posix_spawn(&pid, arguments[0], &actions, nullptr, arguments.data(), environ) == 0);
  posix_spawn_file_actions_destroy(&actions);
  return pid;
}

int WaitFor(pid_t pid) {
  int status = 0;
  STANCE_CHECK(waitpid(pid, &status, 0) == pid);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Appends what can be read; false at the end of the stream.
bool ReadSome(int descriptor, std::string* text) {
  std::array<char, 4096> buffer;
  const ssize_t count = read(descriptor, buffer.data(), buffer.size());
  if (count <= 0) return false;
  text->append(buffer.data(), static_cast<size_t>(count));
  return true;
}

}  // namespace

ProgramResult RunProgram(const std::vector<std::string>& command) {
  const Pipe out, err;
  const pid_t pid = Spawn(command, out.write_end, err.write_end);
  close(out.write_end);
  close(err.write_end);
  ProgramResult result;
  // Both at once: a program that fills one pipe waits until somebody reads it.
  std::array<pollfd, 2> ends = {{{out.read_end, POLLIN, 0}, {err.read_end, POLLIN, 0}}};
  std::string* const texts[] = {&result.out, &result.err};
  for (int open = 2; open > 0;) {
    STANCE_CHECK(poll(ends.data(), ends.size(), -1) > 0);
    for (size_t i = 0; i < ends.size(); ++i) {
      if (ends[i].fd >= 0 && ends[i].revents != 0 && !ReadSome(ends[i].fd, texts[i])) {
        close(ends[i].fd);
        ends[i].fd = -1;
        --open;
      }
    }
  }
  result.exit_code = WaitFor(pid);
  return result;
}

BackgroundProgram::BackgroundProgram(const std::vector<std::string>& command,
                                     const std::string& stderr_file) {
  const Pipe out;
  const int err = open(stderr_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  STANCE_CHECK(err >= 0);
  pid_ = Spawn(command, out.write_end, err);
  close(out.write_end);
  close(err);
  stdout_ = out.read_end;
}

BackgroundProgram::~BackgroundProgram() {
  if (!waited_) {
    Signal(SIGKILL);
    Wait();
  }
  close(stdout_);
}

std::string BackgroundProgram::ReadLine() {
  std::string line;
  char c;
  while (read(stdout_, &c, 1) == 1 && c != '\n') line += c;
  return line;
}

void BackgroundProgram::Signal(int signal) const { kill(pid_, signal); }

int BackgroundProgram::Wait() {
  if (!waited_) {
    exit_code_ = WaitFor(pid_);
    waited_ = true;
  }
  return exit_code_;
}

}  // namespace stance::testing
