#include "server/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

#include "core/base/threads.h"
#include "server/version.h"

namespace stance {
namespace {

// Wrong use, as the shell's own commands report it.
constexpr int kUsage = 2;

absl::Status ReadAll(ServerConfig& config, const std::string& file,
                     const std::map<std::string, std::string>& flags) {
  if (!file.empty()) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return absl::NotFoundError(fmt::format("{}: cannot be read", file));
    const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    const absl::Status status = ApplyToml(config, text);
    if (!status.ok()) {
      return absl::InvalidArgumentError(fmt::format("{}: {}", file, std::string(status.message())));
    }
  }
  STANCE_RETURN_IF_ERROR(ApplyEnvironment(config, [](const std::string& name) -> std::optional<std::string> {
    const char* value = std::getenv(name.c_str());
    if (value == nullptr) return std::nullopt;
    return value;
  }));
  for (const auto& [key, value] : flags) STANCE_RETURN_IF_ERROR(SetOption(config, key, value));
  return FinishConfig(config, CpuQuota());
}

}  // namespace

std::variant<ServerConfig, ExitNow> ReadCommandLine(int argc, char** argv) {
  CLI::App app("Serves pose transfer between 3D characters over gRPC.");
  app.set_version_flag("--version", std::string("stance-server ") + kVersion);
  std::string file;
  app.add_option("--config", file, "TOML file of options");
  std::map<std::string, std::string> values;
  const std::vector<OptionHelp> options = ConfigOptions();
  for (const OptionHelp& option : options) {
    std::string names = FlagName(option.key);
    if (option.key == "server.listen") names = "--listen," + names;
    if (option.key == "model.directory") names = "--model," + names;
    CLI::Option* flag =
        app.add_option(names, values[option.key], fmt::format("{} [{}]", option.help, option.default_value));
    if (option.is_list) {
      flag->join(kListSeparator);  // may be repeated
    } else {
      flag->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    }
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return ExitNow{app.exit(error) == 0 ? 0 : kUsage};
  }
  std::map<std::string, std::string> flags;
  for (const OptionHelp& option : options) {
    if (app.count(FlagName(option.key)) > 0) flags[option.key] = values[option.key];
  }
  ServerConfig config;
  const absl::Status status = ReadAll(config, file, flags);
  if (!status.ok()) {
    std::fprintf(stderr, "stance-server: %s\n", std::string(status.message()).c_str());
    return ExitNow{kUsage};
  }
  return config;
}

}  // namespace stance
