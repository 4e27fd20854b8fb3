// Encryption, tokens, quotas and traces of the real server.

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/base/files.h"
#include "core/base/sha256.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "proto/wire/mesh_wire.h"
#include "stance/v1/pose_transfer.grpc.pb.h"
#include "stance/v1/server_info.grpc.pb.h"
#include "tests/integration/measured_server.h"
#include "tests/support/certificates.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

namespace fs = std::filesystem;
using testing::Authority;
using ::testing::HasSubstr;
using testing::KeyPair;
using testing::MeasuredServer;
using ::testing::Not;
using testing::ProgramResult;
using testing::RunProgram;

constexpr char kAccepted[] = "stance_token_reloads_total{result=\"accepted\"}";
constexpr char kRefused[] = "stance_token_reloads_total{result=\"refused\"}";

std::string Text(const fs::path& path) {
  const absl::StatusOr<std::string> text = ReadFile(path);
  EXPECT_TRUE(text.ok()) << text.status();
  return text.value_or("");
}

// A folder for the files of one test.
class SecurityTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("stance-security-") +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path Folder(const std::string& name) const {
    fs::create_directories(folder_ / name);
    return folder_ / name;
  }

  fs::path folder_;
};

std::shared_ptr<grpc::Channel> ChannelTo(
    const MeasuredServer& server,
    const std::shared_ptr<grpc::ChannelCredentials>& credentials = grpc::InsecureChannelCredentials()) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  return grpc::CreateCustomChannel(server.address(), credentials, arguments);
}

std::shared_ptr<grpc::ChannelCredentials> Tls(const fs::path& authority, const KeyPair& own = {}) {
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = Text(authority);
  if (!own.key.empty()) {
    options.pem_cert_chain = Text(own.certificate);
    options.pem_private_key = Text(own.key);
  }
  return grpc::SslCredentials(options);
}

grpc::Status CheckHealth(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
  grpc::health::v1::HealthCheckResponse response;
  return grpc::health::v1::Health::NewStub(channel)->Check(&context, {}, &response);
}

using Metadata = std::multimap<std::string, std::string>;

struct Answer {
  grpc::Status status;
  std::map<std::string, std::string> trailers;

  std::string Reason() const {
    google::rpc::Status details;
    EXPECT_TRUE(details.ParseFromString(status.error_details()));
    google::rpc::ErrorInfo info;
    for (const auto& detail : details.details()) {
      if (detail.Is<google::rpc::ErrorInfo>()) detail.UnpackTo(&info);
    }
    return info.reason();
  }
};

template <typename Send>
Answer CallWith(const Metadata& metadata, const Send& send) {
  Answer answer;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(2));
  for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
  answer.status = send(&context);
  for (const auto& [key, value] : context.GetServerTrailingMetadata()) {
    answer.trailers[std::string(key.data(), key.size())] = std::string(value.data(), value.size());
  }
  return answer;
}

Answer CallRig(const std::shared_ptr<grpc::Channel>& channel, const Metadata& metadata) {
  v1::RigRequest request;
  MeshToArrays(testing::Icosphere(3), request.mutable_mesh()->mutable_arrays());
  v1::RigResponse response;
  const auto stub = v1::PoseTransferService::NewStub(channel);
  return CallWith(metadata,
                  [&](grpc::ClientContext* context) { return stub->Rig(context, request, &response); });
}

Answer GetInfo(const std::shared_ptr<grpc::Channel>& channel, const Metadata& metadata) {
  v1::GetServerInfoResponse response;
  const auto stub = v1::ServerInfoService::NewStub(channel);
  return CallWith(metadata,
                  [&](grpc::ClientContext* context) { return stub->GetServerInfo(context, {}, &response); });
}

Metadata Bearer(const std::string& token) { return {{"authorization", "Bearer " + token}}; }

// --- Encryption.

std::vector<std::string> TlsArguments(const KeyPair& pair) {
  return {"--tls-certificate", pair.certificate, "--tls-key", pair.key};
}

TEST_F(SecurityTest, TlsServesOnlyClientsThatKnowItsAuthority) {
  const Authority authority(Folder("a")), other(Folder("b"));
  auto server = MeasuredServer::Start(TlsArguments(authority.Issue("server")));
  ASSERT_NE(server, nullptr);
  const grpc::Status served = CheckHealth(ChannelTo(*server, Tls(authority.certificate())));
  EXPECT_TRUE(served.ok()) << served.error_message();
  EXPECT_EQ(CheckHealth(ChannelTo(*server)).error_code(), grpc::UNAVAILABLE) << "without encryption";
  EXPECT_EQ(CheckHealth(ChannelTo(*server, Tls(other.certificate()))).error_code(), grpc::UNAVAILABLE)
      << "with another authority";
  EXPECT_THAT(server->Log(), HasSubstr(R"("tls":"on")"));
  const auto now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_NEAR(server->Metric("stance_tls_certificate_expiry_seconds"), now + 2 * 86400, 3600);
}

TEST_F(SecurityTest, MutualTlsServesOnlyClientsWithACertificate) {
  const Authority servers(Folder("servers")), clients(Folder("clients")), others(Folder("others"));
  std::vector<std::string> arguments = TlsArguments(servers.Issue("server"));
  arguments.insert(arguments.end(), {"--tls-client-ca", clients.certificate()});
  auto server = MeasuredServer::Start(arguments);
  ASSERT_NE(server, nullptr);
  const auto check = [&](const KeyPair& own) {
    return CheckHealth(ChannelTo(*server, Tls(servers.certificate(), own)));
  };
  const grpc::Status served = check(clients.Issue("client"));
  EXPECT_TRUE(served.ok()) << served.error_message();
  EXPECT_EQ(check({}).error_code(), grpc::UNAVAILABLE) << "without a certificate";
  EXPECT_EQ(check(others.Issue("client")).error_code(), grpc::UNAVAILABLE) << "with another's certificate";
  EXPECT_THAT(server->Log(), HasSubstr(R"("tls":"mutual")"));
}

TEST_F(SecurityTest, AReplacedCertificateIsServedWithoutARestart) {
  const Authority before(Folder("before")), after(Folder("after"));
  const KeyPair served{folder_ / "server.pem", folder_ / "server.key"};
  const auto put = [&](const KeyPair& pair) {
    ASSERT_TRUE(WriteFile(served.key, Text(pair.key)).ok());
    ASSERT_TRUE(WriteFile(served.certificate, Text(pair.certificate)).ok());
  };
  put(before.Issue("server"));
  std::vector<std::string> arguments = TlsArguments(served);
  arguments.insert(arguments.end(), {"--tls-reload-seconds", "1"});
  auto server = MeasuredServer::Start(arguments);
  ASSERT_NE(server, nullptr);
  ASSERT_TRUE(CheckHealth(ChannelTo(*server, Tls(before.certificate()))).ok());
  ASSERT_FALSE(CheckHealth(ChannelTo(*server, Tls(after.certificate()))).ok());
  // A connection stays as it was made.
  const auto old_connection = ChannelTo(*server, Tls(before.certificate()));
  ASSERT_TRUE(CheckHealth(old_connection).ok());
  put(after.Issue("server"));
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!CheckHealth(ChannelTo(*server, Tls(after.certificate()))).ok()) {
    ASSERT_LT(std::chrono::steady_clock::now(), give_up) << server->Log();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(CheckHealth(ChannelTo(*server, Tls(before.certificate()))).error_code(), grpc::UNAVAILABLE);
  EXPECT_TRUE(CheckHealth(old_connection).ok());
}

TEST_F(SecurityTest, TlsFilesThatCannotServeAreRefusedAtTheStart) {
  const Authority authority(Folder("a"));
  const KeyPair pair = authority.Issue("server"), other = authority.Issue("other");
  const auto refused = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {STANCE_SERVER_BINARY, "--model", STANCE_UNTRAINED_MODEL, "--listen",
                                         "127.0.0.1:0", "--metrics-listen", "", "--log-format", "text"});
    const ProgramResult result = RunProgram(arguments);
    EXPECT_NE(result.exit_code, 0);
    EXPECT_THAT(result.err, Not(HasSubstr("PRIVATE KEY")));
    return result.err;
  };
  EXPECT_THAT(refused({"--tls-certificate", pair.certificate}), HasSubstr("want both or neither"));
  EXPECT_THAT(refused({"--tls-client-ca", pair.certificate}), HasSubstr("tls.client_ca: needs"));
  EXPECT_THAT(refused({"--tls-certificate", pair.certificate, "--tls-key", other.key}),
              HasSubstr("the key is not the certificate's"));
  EXPECT_THAT(refused({"--tls-certificate", pair.key, "--tls-key", pair.key}),
              HasSubstr("the certificate is not PEM"));
  EXPECT_THAT(refused({"--tls-certificate", pair.certificate, "--tls-key", pair.certificate}),
              HasSubstr("the key is not PEM"));
  EXPECT_THAT(refused({"--tls-certificate", pair.certificate, "--tls-key", folder_ / "nowhere"}),
              HasSubstr("tls.key: "));
  EXPECT_THAT(
      refused({"--tls-certificate", pair.certificate, "--tls-key", pair.key, "--tls-client-ca", pair.key}),
      HasSubstr("tls.client_ca: "));
}

// --- Tokens.

std::string ClientTable(const std::string& name, const std::string& token, const std::string& more = "") {
  return "[clients." + name + "]\ntoken_sha256 = \"" + ToHex(Sha256(token)) + "\"\n" + more;
}

class TokenTest : public SecurityTest {
 protected:
  void Put(const std::string& text) const { ASSERT_TRUE(WriteFile(folder_ / "tokens.toml", text).ok()); }
  std::unique_ptr<MeasuredServer> Start() const {
    return MeasuredServer::Start({"--auth-token-file", folder_ / "tokens.toml"});
  }
};

TEST_F(TokenTest, EveryMethodNeedsAClientsToken) {
  Put(ClientTable("studio", "alpha-token") + ClientTable("lab", "gamma-token"));
  auto server = Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  for (const auto& method : {CallRig, GetInfo}) {
    EXPECT_TRUE(method(channel, Bearer("alpha-token")).status.ok());
    EXPECT_TRUE(method(channel, Bearer("gamma-token")).status.ok());
    const Answer none = method(channel, {});
    EXPECT_EQ(none.status.error_code(), grpc::UNAUTHENTICATED);
    EXPECT_EQ(none.Reason(), "TOKEN_MISSING");
    const Answer wrong = method(channel, Bearer("alpha-tokem"));
    EXPECT_EQ(wrong.status.error_code(), grpc::UNAUTHENTICATED);
    EXPECT_EQ(wrong.Reason(), "TOKEN_UNKNOWN");
    Metadata twice = Bearer("alpha-token");
    twice.insert(*Bearer("gamma-token").begin());
    EXPECT_EQ(method(channel, twice).Reason(), "TOKEN_MISSING");
  }
  EXPECT_EQ(server->Metric("stance_rejections_total{reason=\"TOKEN_MISSING\"}"), 4);
  EXPECT_EQ(server->Metric("stance_rejections_total{reason=\"TOKEN_UNKNOWN\"}"), 2);
  EXPECT_TRUE(CheckHealth(channel).ok()) << "health stays open";
  EXPECT_THAT(server->Log(), HasSubstr(R"("client":"studio")"));
  EXPECT_THAT(server->Log(), HasSubstr(R"("event":"tokens without TLS")"));
}

// The rates are so low that no machine is slow enough for a second request to be within them.
TEST_F(TokenTest, OverQuotaIsRefusedWithReasonAndPushback) {
  Put(ClientTable("few", "token-1", "requests_per_second = 0.001\n") +
      ClientTable("small", "token-2", "vertices_per_second = 0.001\n") + ClientTable("free", "token-3"));
  auto server = Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  const std::map<std::string, std::string> reasons = {{"token-1", "REQUEST_QUOTA"},
                                                      {"token-2", "VERTEX_QUOTA"}};
  for (const auto& [token, reason] : reasons) {
    EXPECT_TRUE(CallRig(channel, Bearer(token)).status.ok());
    const Answer refused = CallRig(channel, Bearer(token));
    EXPECT_EQ(refused.status.error_code(), grpc::RESOURCE_EXHAUSTED);
    EXPECT_EQ(refused.Reason(), reason);
    ASSERT_TRUE(refused.trailers.contains("grpc-retry-pushback-ms")) << reason;
    const double wait = std::atof(refused.trailers.at("grpc-retry-pushback-ms").c_str());
    EXPECT_GT(wait, 0);
    // A request, or 642 vertices, at one in a thousand seconds.
    EXPECT_LE(wait, reason == "REQUEST_QUOTA" ? 1e6 : 642e6);
    EXPECT_EQ(server->Metric("stance_rejections_total{reason=\"" + reason + "\"}"), 1);
  }
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(CallRig(channel, Bearer("token-3")).status.ok());
  EXPECT_TRUE(GetInfo(channel, Bearer("token-2")).status.ok()) << "it has no vertices";
}

TEST_F(TokenTest, AReplacedFileIsReadAndABadOneIsNot) {
  Put(ClientTable("studio", "old-token"));
  auto server = Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  EXPECT_EQ(server->Metric(kAccepted), 1);
  Put(ClientTable("studio", "new-token"));
  server->AwaitMetric(kAccepted, 2);
  EXPECT_EQ(GetInfo(channel, Bearer("old-token")).Reason(), "TOKEN_UNKNOWN");
  EXPECT_TRUE(GetInfo(channel, Bearer("new-token")).status.ok());
  EXPECT_EQ(server->Metric("stance_token_reload_success"), 1);
  Put("[clients.studio]\ntoken_sha256 = \"plain-token\"\n");
  server->AwaitMetric(kRefused, 1);
  EXPECT_EQ(server->Metric("stance_token_reload_success"), 0);
  EXPECT_TRUE(GetInfo(channel, Bearer("new-token")).status.ok());
  EXPECT_THAT(server->Log(), HasSubstr("clients.studio.token_sha256"));
  EXPECT_THAT(server->Log(), Not(HasSubstr("plain-token")));
}

// The folder's own link is replaced, which no watch of the folder sees.
TEST_F(TokenTest, ASighupReadsTheFile) {
  for (const char* version : {"1", "2"}) {
    ASSERT_TRUE(WriteFile(Folder(version) / "tokens.toml",
                          ClientTable("studio", std::string("token-") + std::string(version)))
                    .ok());
  }
  fs::create_directory_symlink("1", folder_ / "current");
  auto server = MeasuredServer::Start({"--auth-token-file", folder_ / "current" / "tokens.toml"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  fs::create_directory_symlink("2", folder_ / "next");
  fs::rename(folder_ / "next", folder_ / "current");
  EXPECT_TRUE(GetInfo(channel, Bearer("token-1")).status.ok());
  server->Signal(SIGHUP);
  server->AwaitMetric(kAccepted, 2);
  EXPECT_EQ(GetInfo(channel, Bearer("token-1")).Reason(), "TOKEN_UNKNOWN");
  EXPECT_TRUE(GetInfo(channel, Bearer("token-2")).status.ok());
  EXPECT_EQ(server->Stop(), 0) << "a SIGHUP ends nothing";
}

TEST_F(TokenTest, ASighupWithoutTokensEndsNothing) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  server->Signal(SIGHUP);
  EXPECT_TRUE(GetInfo(ChannelTo(*server), {}).status.ok());
  EXPECT_EQ(server->Stop(), 0);
}

TEST_F(TokenTest, AServerWithoutItsTokensDoesNotStart) {
  for (const char* text : {"", "[clients.studio]\ntoken_sha256 = \"plain-token\"\n"}) {
    if (*text != '\0') Put(text);
    const ProgramResult result =
        RunProgram({STANCE_SERVER_BINARY, "--model", STANCE_UNTRAINED_MODEL, "--listen", "127.0.0.1:0",
                    "--metrics-listen", "", "--auth-token-file", folder_ / "tokens.toml"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("auth.token_file: "));
    EXPECT_THAT(result.err, Not(HasSubstr("plain-token")));
  }
}

// Neither tokens, right or wrong, nor their digests.
TEST_F(TokenTest, NoSecretIsLogged) {
  Put(ClientTable("studio", "right-token", "requests_per_second = 1\n"));
  auto server = MeasuredServer::Start(
      {"--auth-token-file", folder_ / "tokens.toml", "--log-level", "debug", "--inference-workers", "1"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  for (const Metadata& metadata :
       {Bearer("right-token"), Bearer("right-token"), Bearer("wrong-token"),
        Metadata{{"authorization", "Basic wrong-token"}}, Metadata{{"authorization", "wrong-token"}}}) {
    CallRig(channel, metadata);
  }
  EXPECT_EQ(server->Stop(), 0);
  EXPECT_THAT(server->Log(), HasSubstr("TOKEN_UNKNOWN"));
  for (const std::string token : {"right-token", "wrong-token"}) {
    EXPECT_THAT(server->Log(), Not(HasSubstr(token)));
    EXPECT_THAT(server->Log(), Not(HasSubstr(ToHex(Sha256(token)).substr(0, 16))));
  }
}

// --- The tools.

TEST_F(TokenTest, TheToolsBringTlsAndToken) {
  const Authority authority(Folder("a"));
  Put(ClientTable("studio", "alpha-token"));
  std::vector<std::string> arguments = TlsArguments(authority.Issue("server"));
  arguments.insert(arguments.end(), {"--auth-token-file", folder_ / "tokens.toml", "--tls-client-ca",
                                     authority.certificate()});
  auto server = MeasuredServer::Start(arguments);
  ASSERT_NE(server, nullptr);
  const KeyPair client = authority.Issue("client");
  ASSERT_TRUE(WriteFile(folder_ / "token", "alpha-token\n").ok());
  ASSERT_TRUE(WriteFile(folder_ / "wrong", "beta-token\n").ok());
  const auto run = [&](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(),
                 {"--server", server->address(), "--timeout", "60", "--tls-ca", authority.certificate(),
                  "--tls-cert", client.certificate, "--tls-key", client.key});
    words.insert(words.end(), more.begin(), more.end());
    return RunProgram(words);
  };
  const std::string source = STANCE_SAMPLE "/source.glb", reference = STANCE_SAMPLE "/reference.glb";
  const std::vector<std::string> info = {STANCE_BINARY, "server-info"};
  const std::vector<std::string> transfer = {STANCE_BINARY, "transfer", source,
                                             reference,     "-o",       folder_ / "out.obj"};
  const std::vector<std::string> load = {STANCE_LOAD_BINARY, source, reference, "--requests", "2"};
  for (const auto& command : {info, transfer, load}) {
    const ProgramResult served = run(command, {"--token-file", folder_ / "token"});
    EXPECT_EQ(served.exit_code, 0) << served.err;
    EXPECT_EQ(run(command, {"--token-file", folder_ / "wrong"}).exit_code, 5);
  }
  EXPECT_THAT(run(info, {}).err, HasSubstr("[TOKEN_MISSING]"));
  EXPECT_THAT(run(info, {"--token-file", folder_ / "wrong"}).err, HasSubstr("[TOKEN_UNKNOWN]"));
  setenv("STANCE_TOKEN", "alpha-token", 1);
  EXPECT_EQ(run(info, {}).exit_code, 0);
  setenv("STANCE_TOKEN_FILE", (folder_ / "wrong").c_str(), 1);
  EXPECT_EQ(run(info, {}).exit_code, 5);
  unsetenv("STANCE_TOKEN_FILE");
  unsetenv("STANCE_TOKEN");
  const ProgramResult no_name = run(info, {"--token-file", folder_ / "token", "--tls-name", "elsewhere"});
  EXPECT_EQ(no_name.exit_code, 5);
  EXPECT_THAT(no_name.err, HasSubstr("with TLS"));
}

// --- Traces.

TEST_F(SecurityTest, TheCallersTraceIsLoggedAndAnswered) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  for (const auto& method : {CallRig, GetInfo}) {
    const Answer answer = method(channel, {{"traceparent", "00-" + trace + "-00f067aa0ba902b7-01"}});
    ASSERT_TRUE(answer.status.ok());
    EXPECT_THAT(answer.trailers.at("traceresponse"),
                ::testing::MatchesRegex("00-" + trace + "-[0-9a-f]{16}-01"));
  }
  EXPECT_THAT(server->Log(), HasSubstr("\"trace_id\":\"" + trace + "\""));
  EXPECT_THAT(server->Log(), HasSubstr(R"("parent_span_id":"00f067aa0ba902b7")"));
  for (const Metadata& metadata : {Metadata{}, Metadata{{"traceparent", "00-" + trace + "-00f067aa0ba902b7"}},
                                   Metadata{{"traceparent", "00-" + trace + "-00f067aa0ba902b7-01"},
                                            {"traceparent", "00-" + trace + "-00f067aa0ba902b7-01"}}}) {
    const Answer answer = CallRig(channel, metadata);
    ASSERT_TRUE(answer.status.ok());
    EXPECT_THAT(answer.trailers.at("traceresponse"),
                ::testing::MatchesRegex("00-[0-9a-f]{32}-[0-9a-f]{16}-00"));
    EXPECT_THAT(answer.trailers.at("traceresponse"), Not(HasSubstr(trace)));
  }
}

}  // namespace
}  // namespace stance
