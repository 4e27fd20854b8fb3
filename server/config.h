// The server's options: what they mean, where they come from. docs/operations.md says when to change each.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "core/transfer/model_folders.h"

namespace stance {

// A plain value. Keys are SECTION.NAME in TOML, STANCE_SECTION_NAME in the environment and --SECTION-NAME on
// the command line; the table in config.cc ties them to these fields.
struct ServerConfig {
  std::string server_listen = "127.0.0.1:50051";          // HOST:PORT; port 0 picks a free one
  int64_t server_max_message_bytes = int64_t{256} << 20;  // largest request or answer
  int64_t server_memory_quota_bytes = int64_t{2} << 30;   // gRPC's own buffers
  double server_keepalive_seconds = 60;                   // ping an idle connection after this
  double server_max_connection_age_seconds = 0;           // close a connection after this; 0: never
  bool server_reflection = true;                          // answer gRPC reflection
  double server_lame_duck_seconds = 1;                    // from NOT_SERVING to refusing new requests
  double server_drain_timeout_seconds = 30;               // most time for accepted requests to finish
  std::string tls_certificate;  // PEM file of the server's chain; empty: no encryption
  std::string tls_key;          // PEM file of its private key
  std::string tls_client_ca;    // PEM file of the authorities of clients' certificates; empty: none asked for
  int64_t tls_reload_seconds = 60;  // how often these files are looked at
  std::string auth_token_file;      // TOML file of clients and their tokens; empty: anyone may call
  std::string admin_listen;         // HOST:PORT of AdminService; empty: none
  // Folders of models, or of folders of models; one model of each method.
  std::vector<std::string> model_directory = {"models"};
  std::string model_versions;     // "NAME=VERSION,...": pins; empty: the highest version of each
  int64_t inference_workers = 0;  // batches run at the same time; 0: by the CPU quota
  int64_t inference_threads = 0;  // threads of one batch; 0: the CPU quota / workers
  int64_t inference_rig_cache_bytes = int64_t{256} << 20;  // of rigs kept for meshes that come again; 0: none
  int64_t batching_max_batch_requests = 8;
  int64_t batching_max_batch_vertices = 200'000;
  int64_t batching_max_queued_requests = 256;
  int64_t batching_max_queued_bytes = int64_t{1} << 30;
  int64_t batching_max_queued_vertices = 10'000'000;
  int64_t batching_max_queued_requests_per_client = 0;  // 0: no such bound
  double batching_priority_aging_seconds = 5;           // a step of priority counts as so much waiting
  bool batching_refuse_unmeetable = true;               // refuse what is expected to miss its deadline
  std::string batching_client_metadata = "";            // names the caller; empty: the peer's host does
  int64_t limits_max_vertices = 1'000'000;              // of one mesh
  int64_t limits_max_faces = 4'000'000;                 // of one mesh
  std::string metrics_listen = "127.0.0.1:9464";        // HOST:PORT of /metrics; empty: none
  std::string log_format = "json";                      // "json" or "text"
  std::string log_level = "info";                       // "debug", "info", "warn" or "error"
};

// One option, for help texts and documentation.
struct OptionHelp {
  std::string key;  // "server.listen"
  std::string help;
  std::string default_value;
  bool is_list = false;  // its text is a list separated by kListSeparator
};
std::vector<OptionHelp> ConfigOptions();

// Between the folders of `model.directory` in the environment and on the command line, as in $PATH.
inline constexpr char kListSeparator = ':';

// "one=3,two=1" of `model.versions`. INVALID_ARGUMENT for anything else, and for a name that is there twice.
absl::StatusOr<VersionPins> ParseVersionPins(const std::string& text);

// "server.listen" -> "STANCE_SERVER_LISTEN" and "--server-listen".
std::string EnvironmentName(const std::string& key);
std::string FlagName(const std::string& key);

// Sets one option from text. INVALID_ARGUMENT, naming the key, if there is no such option or the value is not
// one.
absl::Status SetOption(ServerConfig& config, const std::string& key, const std::string& value);

// Sets the options of a TOML document. INVALID_ARGUMENT, naming the key or the line, for a syntax error, an
// unknown key, or a value of the wrong type or range.
absl::Status ApplyToml(ServerConfig& config, const std::string& toml);

// Sets the options that `get` (such as getenv) knows under their environment names.
absl::Status ApplyEnvironment(ServerConfig& config,
                              const std::function<std::optional<std::string>(const std::string&)>& get);

// Fills in what is 0 for "automatic" and checks what concerns several options, given the CPUs there are.
// INVALID_ARGUMENT, naming the keys.
absl::Status FinishConfig(ServerConfig& config, int cpus);

}  // namespace stance
