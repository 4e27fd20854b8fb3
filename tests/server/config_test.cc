#include "server/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>

namespace stance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string ErrorOf(const absl::Status& status) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(ConfigTest, TomlSetsEachType) {
  ServerConfig config;
  ASSERT_TRUE(ApplyToml(config, R"(
[server]
listen = "0.0.0.0:1"
reflection = false
lame_duck_seconds = 2.5
drain_timeout_seconds = 7
[batching]
max_batch_requests = 3
)")
                  .ok());
  EXPECT_EQ(config.server_listen, "0.0.0.0:1");
  EXPECT_FALSE(config.server_reflection);
  EXPECT_EQ(config.server_lame_duck_seconds, 2.5);
  EXPECT_EQ(config.server_drain_timeout_seconds, 7);
  EXPECT_EQ(config.batching_max_batch_requests, 3);
}

struct BadToml {
  const char* text;
  const char* error;  // beginning of the message
};
class BadTomlTest : public ::testing::TestWithParam<BadToml> {};

TEST_P(BadTomlTest, IsRefusedNamingTheKey) {
  ServerConfig config;
  EXPECT_THAT(ErrorOf(ApplyToml(config, GetParam().text)), StartsWith(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Texts, BadTomlTest,
    ::testing::Values(
        BadToml{"[server]\nlisten_on = \"x\"\n", "server.listen_on: unknown option"},
        BadToml{"[sever]\n", "sever: unknown option"}, BadToml{"listen = \"x\"\n", "listen: unknown option"},
        BadToml{"[server]\nlisten = 5\n", "server.listen: want a string"},
        BadToml{"[server]\nreflection = 1\n", "server.reflection: want true or false"},
        BadToml{"[batching]\nmax_batch_requests = 1.5\n", "batching.max_batch_requests: want a whole number"},
        BadToml{"[batching]\nmax_batch_requests = 0\n", "batching.max_batch_requests: 0 is not"},
        BadToml{"[server]\nlame_duck_seconds = \"1\"\n", "server.lame_duck_seconds: want a number"},
        BadToml{"[server]\nlame_duck_seconds = nan\n", "server.lame_duck_seconds: nan is not"},
        BadToml{"[batching]\npriority_aging_seconds = -1\n", "batching.priority_aging_seconds: -1 is not"},
        BadToml{"[batching]\nmax_queued_vertices = 0\n", "batching.max_queued_vertices: 0 is not"},
        BadToml{"[batching]\nmax_queued_requests_per_client = -1\n",
                "batching.max_queued_requests_per_client: -1 is not"},
        BadToml{"[batching]\nrefuse_unmeetable = 1\n", "batching.refuse_unmeetable: want true or false"},
        BadToml{"[batching]\nclient_metadata = \"Client\"\n", "batching.client_metadata: 'Client' is not"},
        BadToml{"[batching]\nclient_metadata = \"grpc-client\"\n",
                "batching.client_metadata: 'grpc-client' is not"},
        BadToml{"[batching]\nclient_metadata = \"client-bin\"\n",
                "batching.client_metadata: 'client-bin' is not"},
        BadToml{"[model]\ndirectory = 5\n", "model.directory: want strings"},
        BadToml{"[model]\ndirectory = [\"a\", 5]\n", "model.directory: want strings"},
        BadToml{"[model]\ndirectory = []\n", "model.directory: '' is not a list of names"},
        BadToml{"[log]\nformat = \"xml\"\n", "log.format: 'xml' is not one of json, text"},
        BadToml{"[server\n", "line 1: "}));

TEST(ConfigTest, OptionsReadText) {
  ServerConfig config;
  EXPECT_TRUE(SetOption(config, "server.reflection", "false").ok());
  EXPECT_FALSE(config.server_reflection);
  EXPECT_TRUE(SetOption(config, "limits.max_vertices", "1234").ok());
  EXPECT_EQ(config.limits_max_vertices, 1234);
  EXPECT_TRUE(SetOption(config, "server.keepalive_seconds", "1.5").ok());
  EXPECT_EQ(config.server_keepalive_seconds, 1.5);
  EXPECT_TRUE(SetOption(config, "batching.client_metadata", "x-client_id.2").ok());
  EXPECT_EQ(config.batching_client_metadata, "x-client_id.2");
  EXPECT_TRUE(SetOption(config, "batching.client_metadata", "").ok());
  EXPECT_THAT(ErrorOf(SetOption(config, "limits.max_vertices", "12x")),
              StartsWith("limits.max_vertices: '12x'"));
  EXPECT_THAT(ErrorOf(SetOption(config, "limits.max_vertices", "")), StartsWith("limits.max_vertices: ''"));
  EXPECT_THAT(ErrorOf(SetOption(config, "server.reflection", "yes")), StartsWith("server.reflection: 'yes'"));
  EXPECT_THAT(ErrorOf(SetOption(config, "server.keepalive_seconds", "fast")),
              StartsWith("server.keepalive_seconds: 'fast'"));
  EXPECT_THAT(ErrorOf(SetOption(config, "nothing.here", "1")), StartsWith("nothing.here: unknown option"));
}

TEST(ConfigTest, ModelFoldersAreAListInEachSpelling) {
  EXPECT_THAT(ServerConfig().model_directory, ElementsAre("models"));
  ServerConfig config;
  ASSERT_TRUE(ApplyToml(config, "[model]\ndirectory = \"one\"\n").ok());
  EXPECT_THAT(config.model_directory, ElementsAre("one"));
  ASSERT_TRUE(ApplyToml(config, "[model]\ndirectory = [\"one:half\", \"two\"]\n").ok());
  EXPECT_THAT(config.model_directory, ElementsAre("one:half", "two"));
  ASSERT_TRUE(SetOption(config, "model.directory", "a:/b/c").ok());
  EXPECT_THAT(config.model_directory, ElementsAre("a", "/b/c"));
  EXPECT_THAT(ErrorOf(SetOption(config, "model.directory", "a::c")), StartsWith("model.directory: 'a::c'"));
  EXPECT_THAT(ErrorOf(SetOption(config, "model.directory", "")), StartsWith("model.directory: ''"));
}

TEST(ConfigTest, VersionsArePinnedByName) {
  ServerConfig config;
  ASSERT_TRUE(ApplyToml(config, "[model]\nversions = \"one=3,two=12\"\n").ok());
  EXPECT_THAT(ParseVersionPins(config.model_versions).value(),
              ElementsAre(std::pair("one", 3), std::pair("two", 12)));
  EXPECT_TRUE(ParseVersionPins("").value().empty());
  for (const char* wrong : {"one", "=3", "one=", "one=0", "one=-1", "one=2.5", "one=1,", "one=1,one=2"}) {
    EXPECT_THAT(ErrorOf(SetOption(config, "model.versions", wrong)),
                StartsWith("model.versions: '" + std::string(wrong) + "' is not NAME=VERSION"));
  }
}

TEST(ConfigTest, AdministrationFromElsewhereNeedsTokens) {
  for (const char* here : {"", "127.0.0.1:1", "localhost:1", "[::1]:1"}) {
    ServerConfig config;
    config.admin_listen = here;
    EXPECT_TRUE(FinishConfig(config, 1).ok()) << here;
  }
  for (const char* anywhere : {"0.0.0.0:1", "[::]:1", "example.org:1", "127.example.org:1"}) {
    ServerConfig config;
    config.admin_listen = anywhere;
    EXPECT_THAT(ErrorOf(FinishConfig(config, 1)), StartsWith("admin.listen: " + std::string(anywhere)));
    config.auth_token_file = "tokens.toml";
    EXPECT_TRUE(FinishConfig(config, 1).ok()) << anywhere;
  }
}

TEST(ConfigTest, TheEnvironmentSpellsKeysInCapitals) {
  EXPECT_EQ(EnvironmentName("server.max_message_bytes"), "STANCE_SERVER_MAX_MESSAGE_BYTES");
  EXPECT_EQ(FlagName("server.max_message_bytes"), "--server-max-message-bytes");
  std::map<std::string, std::string> environment = {{"STANCE_MODEL_DIRECTORY", "/models/a"},
                                                    {"STANCE_OTHER", "x"}};
  const auto get = [&](const std::string& name) -> std::optional<std::string> {
    const auto it = environment.find(name);
    if (it == environment.end()) return std::nullopt;
    return it->second;
  };
  ServerConfig config;
  ASSERT_TRUE(ApplyEnvironment(config, get).ok());
  EXPECT_THAT(config.model_directory, ElementsAre("/models/a"));
  environment["STANCE_LOG_LEVEL"] = "loud";
  EXPECT_THAT(ErrorOf(ApplyEnvironment(config, get)), StartsWith("STANCE_LOG_LEVEL: log.level: 'loud'"));
}

TEST(ConfigTest, WorkersTimesThreadsFitTheCpus) {
  for (int cpus = 1; cpus <= 64; ++cpus) {
    ServerConfig config = ServerConfig();
    ASSERT_TRUE(FinishConfig(config, cpus).ok());
    EXPECT_GE(config.inference_workers, 1);
    EXPECT_GE(config.inference_threads, 1);
    EXPECT_LE(config.inference_workers * config.inference_threads, cpus);
  }
  ServerConfig workers_only = ServerConfig();
  workers_only.inference_workers = 3;
  ASSERT_TRUE(FinishConfig(workers_only, 8).ok());
  EXPECT_EQ(workers_only.inference_threads, 2);
  ServerConfig too_many = ServerConfig();
  too_many.inference_workers = 3;
  too_many.inference_threads = 2;
  EXPECT_THAT(ErrorOf(FinishConfig(too_many, 5)), HasSubstr("inference.workers x inference.threads: 3 x 2"));
}

TEST(ConfigTest, RefusesWhatCannotServe) {
  ServerConfig small_queue = ServerConfig();
  small_queue.batching_max_queued_bytes = 1000;
  EXPECT_THAT(ErrorOf(FinishConfig(small_queue, 2)),
              StartsWith("batching.max_queued_bytes: 1000 is less than"));
  ServerConfig wide_quota;
  wide_quota.batching_max_queued_requests = 10;
  wide_quota.batching_max_queued_requests_per_client = 10;
  EXPECT_TRUE(FinishConfig(wide_quota, 2).ok());
  wide_quota.batching_max_queued_requests_per_client = 11;
  EXPECT_THAT(ErrorOf(FinishConfig(wide_quota, 2)),
              StartsWith("batching.max_queued_requests_per_client: 11 is more than"));
}

TEST(ConfigTest, TlsNeedsACertificateWithItsKey) {
  ServerConfig config;
  config.tls_certificate = "a.pem";
  EXPECT_THAT(ErrorOf(FinishConfig(config, 2)), StartsWith("tls.certificate, tls.key: "));
  config.tls_key = "a.key";
  config.tls_client_ca = "ca.pem";
  EXPECT_TRUE(FinishConfig(config, 2).ok());
  config.tls_certificate = config.tls_key = "";
  EXPECT_THAT(ErrorOf(FinishConfig(config, 2)), StartsWith("tls.client_ca: "));
}

// Every option's default is one that SetOption accepts, so that the help text can be copied.
TEST(ConfigTest, DefaultsAreValidValues) {
  for (const OptionHelp& option : ConfigOptions()) {
    std::string value = option.default_value;
    if (option.is_list) value = value.substr(1, value.size() - 2);
    if (value.starts_with('"')) value = value.substr(1, value.size() - 2);
    ServerConfig config;
    EXPECT_TRUE(SetOption(config, option.key, value).ok()) << option.key << " = " << option.default_value;
    EXPECT_FALSE(option.help.empty());
  }
}

// docs/operations.md and the shipped file name every option with its default.
TEST(ConfigTest, TheDocumentsListEveryOption) {
  std::ifstream stream(STANCE_SOURCE_DIR "/docs/operations.md");
  const std::string page((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  for (const OptionHelp& option : ConfigOptions()) {
    EXPECT_THAT(page, HasSubstr("| `" + option.key + "` | `" + option.default_value + "` |"));
  }
  std::ifstream shipped(STANCE_SOURCE_DIR "/deploy/stance-server.toml");
  const std::string toml((std::istreambuf_iterator<char>(shipped)), std::istreambuf_iterator<char>());
  ServerConfig config;
  EXPECT_TRUE(ApplyToml(config, toml).ok());
  for (const OptionHelp& option : ConfigOptions()) {
    const std::string name = option.key.substr(option.key.find('.') + 1);
    EXPECT_THAT(toml, HasSubstr("\n" + name + " = " + option.default_value));
  }
}

}  // namespace
}  // namespace stance
