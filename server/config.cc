#include "server/config.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

namespace stance {
namespace {

using Texts = std::vector<std::string>;
using Field = std::variant<std::string ServerConfig::*, int64_t ServerConfig::*, double ServerConfig::*,
                           bool ServerConfig::*, Texts ServerConfig::*>;

struct Option {
  const char* key;
  Field field;
  double least;  // numbers only, as is `most`
  double most;
  const char* help;
};

constexpr double kMany = 1e15;

const std::vector<Option>& Table() {
  using C = ServerConfig;
  static const std::vector<Option> table = {
      {"server.listen", &C::server_listen, 0, 0, "HOST:PORT to serve on; port 0 picks a free one"},
      {"server.max_message_bytes", &C::server_max_message_bytes, 1024, 2147483647,
       "Largest request or answer, bytes"},
      {"server.memory_quota_bytes", &C::server_memory_quota_bytes, 1 << 20, kMany,
       "Memory for gRPC's own buffers, bytes"},
      {"server.keepalive_seconds", &C::server_keepalive_seconds, 1, 1e6,
       "Idle time after which a connection is pinged, seconds"},
      {"server.max_connection_age_seconds", &C::server_max_connection_age_seconds, 0, 1e6,
       "Age at which a connection is closed gracefully, seconds; 0 for never"},
      {"server.reflection", &C::server_reflection, 0, 0, "Whether to answer gRPC reflection"},
      {"server.lame_duck_seconds", &C::server_lame_duck_seconds, 0, 3600,
       "Time between NOT_SERVING and refusing new requests at shutdown, seconds"},
      {"server.drain_timeout_seconds", &C::server_drain_timeout_seconds, 0, 86400,
       "Most time for accepted requests to finish at shutdown, seconds"},
      {"tls.certificate", &C::tls_certificate, 0, 0,
       "PEM file of the server's certificate chain; empty for no encryption"},
      {"tls.key", &C::tls_key, 0, 0, "PEM file of the certificate's private key"},
      {"tls.client_ca", &C::tls_client_ca, 0, 0,
       "PEM file of the authorities of clients' certificates; empty to ask for none"},
      {"tls.reload_seconds", &C::tls_reload_seconds, 1, 86400,
       "How often the TLS files are looked at for changes, seconds"},
      {"auth.token_file", &C::auth_token_file, 0, 0,
       "TOML file of the clients and their tokens; empty to serve anyone"},
      {"admin.listen", &C::admin_listen, 0, 0,
       "HOST:PORT of the service that reloads models; empty for none"},
      {"model.directory", &C::model_directory, 0, 0,
       "Folders of models, or of folders of models; one model of each method"},
      {"model.versions", &C::model_versions, 0, 0,
       "Versions to serve in place of the highest: NAME=VERSION, several separated by commas"},
      {"inference.workers", &C::inference_workers, 0, 1024,
       "Batches run at the same time; 0 chooses by the CPU quota"},
      {"inference.threads", &C::inference_threads, 0, 1024,
       "Threads of one batch; 0 divides the CPU quota by the workers"},
      {"inference.rig_cache_bytes", &C::inference_rig_cache_bytes, 0, kMany,
       "Memory for the rigs of meshes that may come again, bytes; 0 for none"},
      {"batching.max_batch_requests", &C::batching_max_batch_requests, 1, 4096, "Most requests in one batch"},
      {"batching.max_batch_vertices", &C::batching_max_batch_vertices, 1, kMany,
       "Most vertices in one batch"},
      {"batching.max_queued_requests", &C::batching_max_queued_requests, 1, 1e6, "Most requests waiting"},
      {"batching.max_queued_bytes", &C::batching_max_queued_bytes, 1, kMany,
       "Most bytes of requests waiting; at least server.max_message_bytes"},
      {"batching.max_queued_vertices", &C::batching_max_queued_vertices, 1, kMany,
       "Most vertices of requests waiting"},
      {"batching.max_queued_requests_per_client", &C::batching_max_queued_requests_per_client, 0, 1e6,
       "Most requests of one client waiting; 0 for no such bound"},
      {"batching.priority_aging_seconds", &C::batching_priority_aging_seconds, 0, 3600,
       "Waiting that a step of priority counts as, seconds; 0 to ignore priorities"},
      {"batching.refuse_unmeetable", &C::batching_refuse_unmeetable, 0, 0,
       "Whether to refuse at once what is expected to miss its deadline"},
      {"batching.client_metadata", &C::batching_client_metadata, 0, 0,
       "Metadata key that names the client; empty for the peer's host"},
      {"limits.max_vertices", &C::limits_max_vertices, 3, 1e8, "Most vertices of one mesh"},
      {"limits.max_faces", &C::limits_max_faces, 1, 4e8, "Most faces of one mesh"},
      {"metrics.listen", &C::metrics_listen, 0, 0, "HOST:PORT of the Prometheus page; empty for none"},
      {"log.format", &C::log_format, 0, 0, "json or text"},
      {"log.level", &C::log_level, 0, 0, "debug, info, warn or error"},
  };
  return table;
}

const Option* Find(const std::string& key) {
  for (const Option& option : Table()) {
    if (key == option.key) return &option;
  }
  return nullptr;
}

absl::Status UnknownKey(const std::string& key) {
  return absl::InvalidArgumentError(fmt::format("{}: unknown option", key));
}
absl::Status BadValue(const Option& option, const std::string& value, const std::string& want) {
  return absl::InvalidArgumentError(fmt::format("{}: '{}' is not {}", option.key, value, want));
}

absl::Status SetNumber(ServerConfig& config, const Option& option, double value) {
  if (!(value >= option.least && value <= option.most)) {
    return absl::InvalidArgumentError(
        fmt::format("{}: {} is not from {} to {}", option.key, value, option.least, option.most));
  }
  if (const auto* integer = std::get_if<int64_t ServerConfig::*>(&option.field)) {
    config.*(*integer) = static_cast<int64_t>(value);
  } else {
    config.*std::get<double ServerConfig::*>(option.field) = value;
  }
  return absl::OkStatus();
}

// A key as gRPC has them, of a text and not of bytes (-bin); "grpc-" is gRPC's own.
bool IsMetadataKey(const std::string& text) {
  return !text.ends_with("-bin") && !text.starts_with("grpc-") &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
         });
}

absl::Status SetText(ServerConfig& config, const Option& option, const std::string& value) {
  const auto one_of = [&](std::initializer_list<const char*> choices) -> absl::Status {
    if (std::find(choices.begin(), choices.end(), value) != choices.end()) return absl::OkStatus();
    return BadValue(option, value, fmt::format("one of {}", fmt::join(choices, ", ")));
  };
  const std::string key = option.key;
  if (key == "log.format") STANCE_RETURN_IF_ERROR(one_of({"json", "text"}));
  if (key == "log.level") STANCE_RETURN_IF_ERROR(one_of({"debug", "info", "warn", "error"}));
  if (key == "batching.client_metadata" && !IsMetadataKey(value)) {
    return BadValue(option, value, "a text metadata key: lower-case letters, digits, '-', '_', '.'");
  }
  if (key == "model.versions") {
    const absl::StatusOr<VersionPins> pins = ParseVersionPins(value);
    if (!pins.ok()) return BadValue(option, value, std::string(pins.status().message()));
  }
  config.*std::get<std::string ServerConfig::*>(option.field) = value;
  return absl::OkStatus();
}

absl::Status SetTexts(ServerConfig& config, const Option& option, Texts values) {
  if (values.empty() || std::find(values.begin(), values.end(), "") != values.end()) {
    return BadValue(option, fmt::format("{}", fmt::join(values, std::string(1, kListSeparator))),
                    "a list of names");
  }
  config.*std::get<Texts ServerConfig::*>(option.field) = std::move(values);
  return absl::OkStatus();
}

// A string, or an array of strings.
absl::Status SetTextsNode(ServerConfig& config, const Option& option, const toml::node& node) {
  if (const auto* text = node.as_string()) return SetTexts(config, option, {text->get()});
  const auto want = absl::InvalidArgumentError(fmt::format("{}: want strings", option.key));
  const toml::array* array = node.as_array();
  if (array == nullptr) return want;
  Texts values;
  for (const toml::node& element : *array) {
    const auto* text = element.as_string();
    if (text == nullptr) return want;
    values.push_back(text->get());
  }
  return SetTexts(config, option, std::move(values));
}

Texts Split(const std::string& text, char separator) {
  Texts parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

// A TOML value in an option's own type.
absl::Status SetNode(ServerConfig& config, const Option& option, const toml::node& node) {
  if (std::holds_alternative<std::string ServerConfig::*>(option.field)) {
    if (const auto* text = node.as_string()) return SetText(config, option, text->get());
    return absl::InvalidArgumentError(fmt::format("{}: want a string", option.key));
  }
  if (std::holds_alternative<Texts ServerConfig::*>(option.field)) return SetTextsNode(config, option, node);
  if (const auto* flag = std::get_if<bool ServerConfig::*>(&option.field)) {
    const auto* value = node.as_boolean();
    if (value == nullptr)
      return absl::InvalidArgumentError(fmt::format("{}: want true or false", option.key));
    config.*(*flag) = value->get();
    return absl::OkStatus();
  }
  if (const auto* value = node.as_integer()) {
    return SetNumber(config, option, static_cast<double>(value->get()));
  }
  const auto* value = node.as_floating_point();
  if (value != nullptr && std::holds_alternative<double ServerConfig::*>(option.field)) {
    return SetNumber(config, option, value->get());
  }
  return absl::InvalidArgumentError(fmt::format(
      "{}: want {}", option.key,
      std::holds_alternative<double ServerConfig::*>(option.field) ? "a number" : "a whole number"));
}

std::string Respelled(const std::string& key, const std::string& prefix, bool upper, char separator) {
  std::string name = prefix;
  for (char c : key) {
    if (c == '.' || c == '_') c = separator;
    name += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
  }
  return name;
}

std::string ValueText(const ServerConfig& config, const Option& option) {
  return std::visit(
      [&config](auto member) {
        using Value = std::decay_t<decltype(config.*member)>;
        if constexpr (std::is_same_v<Value, std::string>) {
          return fmt::format("\"{}\"", config.*member);
        } else if constexpr (std::is_same_v<Value, Texts>) {
          return fmt::format("[\"{}\"]", fmt::join(config.*member, "\", \""));
        } else {
          return fmt::format("{}", config.*member);
        }
      },
      option.field);
}

// The whole of 127.0.0.0/8, ::1, and the name that stands for them.
bool IsLoopback(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  return host == "localhost" || host == "[::1]" ||
         (host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string::npos);
}

}  // namespace

absl::StatusOr<VersionPins> ParseVersionPins(const std::string& text) {
  VersionPins pins;
  if (text.empty()) return pins;
  for (const std::string& part : Split(text, ',')) {
    const size_t equals = part.find('=');
    int64_t version = 0;
    const char* end = part.data() + part.size();
    if (equals == 0 || equals == std::string::npos) return absl::InvalidArgumentError("NAME=VERSION,...");
    const auto [rest, error] = std::from_chars(part.data() + equals + 1, end, version);
    if (error != std::errc() || rest != end || version < 1) {
      return absl::InvalidArgumentError("NAME=VERSION,... with whole numbers from 1");
    }
    if (!pins.emplace(part.substr(0, equals), version).second) {
      return absl::InvalidArgumentError("NAME=VERSION,... with each name once");
    }
  }
  return pins;
}

std::vector<OptionHelp> ConfigOptions() {
  std::vector<OptionHelp> options;
  const ServerConfig defaults;
  for (const Option& option : Table()) {
    options.push_back({option.key, option.help, ValueText(defaults, option),
                       std::holds_alternative<Texts ServerConfig::*>(option.field)});
  }
  return options;
}

std::string EnvironmentName(const std::string& key) { return Respelled(key, "STANCE_", true, '_'); }

std::string FlagName(const std::string& key) { return Respelled(key, "--", false, '-'); }

absl::Status SetOption(ServerConfig& config, const std::string& key, const std::string& value) {
  const Option* option = Find(key);
  if (option == nullptr) return UnknownKey(key);
  if (std::holds_alternative<std::string ServerConfig::*>(option->field))
    return SetText(config, *option, value);
  if (std::holds_alternative<Texts ServerConfig::*>(option->field)) {
    return SetTexts(config, *option, Split(value, kListSeparator));
  }
  if (const auto* flag = std::get_if<bool ServerConfig::*>(&option->field)) {
    if (value != "true" && value != "false") return BadValue(*option, value, "true or false");
    config.*(*flag) = value == "true";
    return absl::OkStatus();
  }
  const char* end = value.data() + value.size();
  if (std::holds_alternative<int64_t ServerConfig::*>(option->field)) {
    int64_t number = 0;
    const auto [rest, error] = std::from_chars(value.data(), end, number);
    if (error != std::errc() || rest != end) return BadValue(*option, value, "a whole number");
    return SetNumber(config, *option, static_cast<double>(number));
  }
  double number = 0;
  const auto [rest, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || rest != end) return BadValue(*option, value, "a number");
  return SetNumber(config, *option, number);
}

absl::Status ApplyToml(ServerConfig& config, const std::string& text) {
  toml::table document;
  try {
    document = toml::parse(text);
  } catch (const toml::parse_error& error) {
    return absl::InvalidArgumentError(
        fmt::format("line {}: {}", error.source().begin.line, std::string(error.description())));
  }
  for (const auto& [section_key, section_node] : document) {
    const std::string section(section_key.str());
    const toml::table* entries = section_node.as_table();
    if (entries == nullptr) return UnknownKey(section);
    for (const auto& [name, node] : *entries) {
      const std::string key = fmt::format("{}.{}", section, std::string(name.str()));
      const Option* option = Find(key);
      if (option == nullptr) return UnknownKey(key);
      STANCE_RETURN_IF_ERROR(SetNode(config, *option, node));
    }
    // An unknown section without entries is as wrong as one with.
    const bool known = std::any_of(Table().begin(), Table().end(), [&](const Option& option) {
      return std::string(option.key).starts_with(section + ".");
    });
    if (!known) return UnknownKey(section);
  }
  return absl::OkStatus();
}

absl::Status ApplyEnvironment(ServerConfig& config,
                              const std::function<std::optional<std::string>(const std::string&)>& get) {
  for (const Option& option : Table()) {
    const std::string name = EnvironmentName(option.key);
    const std::optional<std::string> value = get(name);
    if (!value) continue;
    const absl::Status status = SetOption(config, option.key, *value);
    if (!status.ok()) {
      return absl::InvalidArgumentError(fmt::format("{}: {}", name, std::string(status.message())));
    }
  }
  return absl::OkStatus();
}

absl::Status FinishConfig(ServerConfig& config, int cpus) {
  if (config.batching_max_queued_bytes < config.server_max_message_bytes) {
    return absl::InvalidArgumentError(
        fmt::format("batching.max_queued_bytes: {} is less than server.max_message_bytes, {}: the largest "
                    "request could never be served",
                    config.batching_max_queued_bytes, config.server_max_message_bytes));
  }
  if (config.batching_max_queued_requests_per_client > config.batching_max_queued_requests) {
    return absl::InvalidArgumentError(fmt::format(
        "batching.max_queued_requests_per_client: {} is more than batching.max_queued_requests, {}: it would "
        "bound nobody",
        config.batching_max_queued_requests_per_client, config.batching_max_queued_requests));
  }
  if (config.tls_certificate.empty() != config.tls_key.empty()) {
    return absl::InvalidArgumentError("tls.certificate, tls.key: want both or neither");
  }
  if (!config.tls_client_ca.empty() && config.tls_certificate.empty()) {
    return absl::InvalidArgumentError("tls.client_ca: needs tls.certificate and tls.key");
  }
  if (!config.admin_listen.empty() && config.auth_token_file.empty() && !IsLoopback(config.admin_listen)) {
    return absl::InvalidArgumentError(fmt::format(
        "admin.listen: {} is not of this machine only, which needs auth.token_file", config.admin_listen));
  }
  // One batch gains little from more than four threads; beyond that, batches run side by side.
  constexpr int64_t kThreadsPerBatch = 4;
  if (config.inference_workers == 0) {
    const int64_t threads = config.inference_threads > 0 ? config.inference_threads : kThreadsPerBatch;
    config.inference_workers = std::max<int64_t>(1, cpus / threads);
  }
  if (config.inference_threads == 0) {
    config.inference_threads = std::max<int64_t>(1, cpus / config.inference_workers);
  }
  if (config.inference_workers * config.inference_threads > cpus) {
    return absl::InvalidArgumentError(fmt::format(
        "inference.workers x inference.threads: {} x {} is more than the {} CPUs this process may use",
        config.inference_workers, config.inference_threads, cpus));
  }
  return absl::OkStatus();
}

}  // namespace stance
