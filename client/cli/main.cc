// The command line tool `stance`.
#include <cstdio>
#include <exception>
#include <variant>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "core/base/allocator.h"

namespace stance {
namespace {

template <typename... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};

absl::Status Run(int argc, const char* const* argv) {
  const absl::StatusOr<Command> command = ParseArguments(argc, argv);
  if (!command.ok()) return UsageError(command.status());
  return std::visit(Overloaded{[](const TransferArguments& a) { return RunTransfer(a); },
                               [](const AnimateArguments& a) { return RunAnimate(a); },
                               [](const RigArguments& a) { return RunRig(a); },
                               [](const InfoArguments& a) { return RunInfo(a); },
                               [](const RenderArguments& a) { return RunRender(a); },
                               [](const ServerInfoArguments& a) { return RunServerInfo(a); },
                               [](const ReloadArguments& a) { return RunReload(a); },
                               [](const TextToPrint& a) {
                                 std::fputs(a.text.c_str(), stdout);
                                 return absl::OkStatus();
                               }},
                    *command);
}

}  // namespace
}  // namespace stance

int main(int argc, char** argv) {
  stance::KeepFreedMemory();  // for --local
  absl::Status status;
  // Nothing of ours throws; the standard library and what it is built on may (no memory).
  try {
    status = stance::Run(argc, argv);
  } catch (const std::exception& error) {
    status = absl::InternalError(error.what());
  }
  if (!status.ok()) std::fputs(stance::ErrorLine("stance", status).c_str(), stderr);
  return static_cast<int>(stance::ExitCodeFor(status));
}
