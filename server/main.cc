// stance-server: pose transfer over gRPC.

#include <csignal>
#include <cstdio>

#include "core/base/allocator.h"
#include "server/command_line.h"
#include "server/log.h"
#include "server/server.h"

int main(int argc, char** argv) {
  auto command_line = stance::ReadCommandLine(argc, argv);
  if (const auto* exit = std::get_if<stance::ExitNow>(&command_line)) return exit->code;
  const auto& config = std::get<stance::ServerConfig>(command_line);
  stance::KeepFreedMemory();
  stance::SetUpLog(config.log_format, config.log_level);

  // Blocked before any thread starts, so that every thread inherits it and only sigwait sees the signals.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // A client or scraper that goes away must not end the process.
  std::signal(SIGPIPE, SIG_IGN);

  auto server = stance::Server::Start(config);
  if (!server.ok()) {
    stance::Log(stance::LogLevel::kError, "start failed",
                {{"error", std::string(server.status().message())}});
    return 1;
  }
  std::printf("listening on %s\n", (*server)->address().c_str());
  std::fflush(stdout);

  int signal = 0;
  while (sigwait(&signals, &signal) == 0 && signal == SIGHUP) (*server)->Reload();
  stance::Log(stance::LogLevel::kInfo, "draining", {{"signal", int64_t{signal}}});
  const bool complete = (*server)->Drain();
  stance::Log(complete ? stance::LogLevel::kInfo : stance::LogLevel::kError, "stopped",
              {{"complete", std::string(complete ? "true" : "false")}});
  return complete ? 0 : 1;
}
