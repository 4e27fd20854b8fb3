// The real server's models replaced while it serves, and its end with clients that hang.

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <functional>
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
#include "stance/v1/admin.grpc.pb.h"
#include "stance/v1/pose_transfer.grpc.pb.h"
#include "stance/v1/server_info.grpc.pb.h"
#include "tests/integration/measured_server.h"
#include "tests/support/meshes.h"
#include "tests/support/process.h"

namespace stance {
namespace {

namespace fs = std::filesystem;
using testing::BackgroundProgram;
using ::testing::HasSubstr;
using testing::MeasuredServer;
using ::testing::Not;

constexpr char kSwitched[] = "stance_model_reloads_total{result=\"switched\"}";
constexpr char kFailed[] = "stance_model_reloads_total{result=\"failed\"}";

std::shared_ptr<grpc::Channel> ChannelTo(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

// The service that reloads, on the address in the log.
std::string AdminAddress(const MeasuredServer& server) {
  const std::string log = server.Log(), before = "\"admin\":\"";
  const size_t start = log.find(before) + before.size();
  return log.substr(start, log.find('"', start) - start);
}

std::string ReasonOf(const grpc::Status& status) {
  google::rpc::Status details;
  google::rpc::ErrorInfo info;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  if (details.details_size() > 0) details.details(0).UnpackTo(&info);
  return info.reason();
}

struct Reloaded {
  grpc::Status status;
  v1::ReloadModelsResponse response;
};

Reloaded Reload(const std::string& address, const std::string& token = "") {
  Reloaded reloaded;
  grpc::ClientContext context;
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(5));
  reloaded.status = v1::AdminService::NewStub(ChannelTo(address))
                        ->ReloadModels(&context, v1::ReloadModelsRequest(), &reloaded.response);
  return reloaded;
}

std::string ServedVersion(const std::shared_ptr<grpc::Channel>& channel) {
  v1::GetServerInfoResponse info;
  grpc::ClientContext context;
  const grpc::Status status =
      v1::ServerInfoService::NewStub(channel)->GetServerInfo(&context, v1::GetServerInfoRequest(), &info);
  if (!status.ok() || info.models_size() != 1 || info.methods_size() != 1) return status.error_message();
  return info.models(0).version();
}

// The target's bytes; empty if the call failed.
std::string Transfer(const std::shared_ptr<grpc::Channel>& channel) {
  v1::TransferRequest request;
  MeshToArrays(testing::Icosphere(2), request.mutable_source()->mutable_arrays());
  MeshToArrays(testing::Capsule(), request.mutable_reference()->mutable_arrays());
  v1::TransferResponse response;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(2));
  const grpc::Status status =
      v1::PoseTransferService::NewStub(channel)->Transfer(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.target().arrays().positions();
}

void Replace(const fs::path& path, const std::string& from, const std::string& to) {
  std::string text = ReadFile(path).value();
  ASSERT_NE(text.find(from), std::string::npos) << path << " lacks " << from;
  ASSERT_TRUE(WriteFile(path, text.replace(text.find(from), from.size(), to)).ok());
}

// Versions of one model, which the server below serves.
class ReloadTest : public ::testing::Test {
 protected:
  ReloadTest() : root_(fs::path(::testing::TempDir()) / ("reload-" + std::to_string(getpid()))) {
    fs::remove_all(root_);
    Install("1", STANCE_UNTRAINED_MODEL, "untrained", "0");
  }
  ~ReloadTest() override { fs::remove_all(root_); }

  // A copy of the model in `from`, whose manifest has that name and version, put into its place whole.
  void Install(const std::string& version, const fs::path& from, const std::string& name,
               const std::string& its_version) const {
    const fs::path aside = root_ / "aside";
    fs::create_directories(Model());
    fs::copy(from, aside);
    Replace(aside / "manifest.json", "\"name\": \"" + name + "\"", "\"name\": \"untrained\"");
    Replace(aside / "manifest.json", "\"version\": \"" + its_version + "\"",
            "\"version\": \"" + version + "\"");
    fs::rename(aside, Version(version));
  }
  // Another model of the same method, with a self-test.
  void InstallOther(const std::string& version) const {
    Install(version, STANCE_SHIPPED_MODELS "/skeletal-human24", "skeletal-human24", "2");
  }
  fs::path Model() const { return root_ / "models" / "untrained"; }
  fs::path Version(const std::string& version) const { return Model() / version; }

  std::unique_ptr<MeasuredServer> Start(std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"--admin-listen", "127.0.0.1:0", "--inference-workers", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return MeasuredServer::Start(arguments, root_ / "models");
  }

  const fs::path root_;
};

TEST_F(ReloadTest, ANewVersionIsServedWithoutAFailedCall) {
  auto server = Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(server->address());
  EXPECT_EQ(ServedVersion(channel), "1");
  const std::string before = Transfer(channel);
  EXPECT_THAT(server->Log(), HasSubstr("\"event\":\"model without a self-test\""));

  std::atomic<bool> stop = false;
  std::atomic<int> answers = 0;
  std::vector<std::jthread> traffic;
  for (int i = 0; i < 3; ++i) {
    traffic.emplace_back([&stop, &answers, address = server->address()] {
      for (const auto own = ChannelTo(address); !stop; ++answers) EXPECT_FALSE(Transfer(own).empty());
    });
  }
  InstallOther("2");
  server->Signal(SIGHUP);
  server->AwaitMetric(kSwitched, 1);
  EXPECT_EQ(ServedVersion(channel), "2");
  EXPECT_NE(Transfer(channel), before) << "other weights give another answer";
  const std::string page = server->Page();
  EXPECT_THAT(page, HasSubstr("name=\"untrained\",version=\"2\"} 1"));
  EXPECT_THAT(page, Not(HasSubstr("name=\"untrained\",version=\"1\"")));

  Install("10", STANCE_UNTRAINED_MODEL, "untrained", "0");
  const Reloaded reloaded = Reload(AdminAddress(*server));
  ASSERT_TRUE(reloaded.status.ok()) << reloaded.status.error_message();
  EXPECT_TRUE(reloaded.response.switched());
  ASSERT_EQ(reloaded.response.models_size(), 1);
  EXPECT_EQ(reloaded.response.models(0).version(), "10");
  EXPECT_EQ(Transfer(channel), before) << "the first weights again";

  const Reloaded again = Reload(AdminAddress(*server));
  ASSERT_TRUE(again.status.ok());
  EXPECT_FALSE(again.response.switched());
  stop = true;
  traffic.clear();
  EXPECT_GT(answers, 0);
  EXPECT_EQ(server->Metric("stance_requests_total{code=\"OK\",rpc=\"ReloadModels\"}"), 2);
  EXPECT_THAT(server->Log(), HasSubstr(R"("event":"models reloaded","models":"untrained 10")"));
  EXPECT_THAT(server->Log(), HasSubstr(R"("event":"models unchanged")"));
  EXPECT_EQ(server->Stop(), 0);
}

// Whatever is wrong with a version, the one before it is served on, and the next good one is taken.
TEST_F(ReloadTest, ABadVersionIsRefusedAndTheFormerServedOn) {
  auto server = Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(server->address());
  const std::string before = Transfer(channel);
  const fs::path weights = Version("2") / "weights.safetensors", manifest = Version("2") / "manifest.json",
                 self_test = Version("2") / "self_test.json";
  struct Case {
    const char* name;
    std::function<void()> spoil;
    std::string error;
  };
  const std::vector<Case> cases = {
      {"weights cut off", [&] { fs::resize_file(weights, fs::file_size(weights) / 2); },
       weights.string() + ": sha256 is"},
      {"another digest",
       [&] { Replace(manifest, ToHex(Sha256(ReadFile(weights).value())), std::string(64, '0')); },
       weights.string() + ": sha256 is"},
      {"a self-test that is off",
       [&] {
         const std::string digest = ToHex(Sha256(ReadFile(self_test).value()));
         Replace(self_test, "\"joint_tolerance\":0.", "\"joint_tolerance\":0.0000");
         Replace(manifest, digest, ToHex(Sha256(ReadFile(self_test).value())));
       },
       Version("2").string() + ": self-test: joint "},
      {"another network", [&] { Replace(manifest, "\"method\": \"skeletal\"", "\"method\": \"stance\""); },
       "is missing"},
      {"another name", [&] { Replace(manifest, "\"name\": \"untrained\"", "\"name\": \"renamed\""); },
       "needs a restart"},
      {"another version", [&] { Replace(manifest, "\"version\": \"2\"", "\"version\": \"3\""); },
       "the manifest's version is '3'"},
      {"no manifest's text", [&] { ASSERT_TRUE(WriteFile(manifest, "{").ok()); }, manifest.string()},
  };
  double failed = 0;
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    fs::remove_all(Version("2"));
    InstallOther("2");
    each.spoil();
    const Reloaded refused = Reload(AdminAddress(*server));
    EXPECT_EQ(refused.status.error_code(), grpc::FAILED_PRECONDITION);
    EXPECT_EQ(ReasonOf(refused.status), "RELOAD_FAILED");
    EXPECT_THAT(refused.status.error_message(), HasSubstr(each.error));
    EXPECT_EQ(server->Metric(kFailed), ++failed);
    EXPECT_EQ(server->Metric("stance_model_reload_success"), 0);
    EXPECT_EQ(ServedVersion(channel), "1");
  }
  EXPECT_EQ(Transfer(channel), before);
  EXPECT_THAT(server->Log(), HasSubstr("\"event\":\"models not reloaded\""));
  server->Signal(SIGHUP);
  server->AwaitMetric(kFailed, failed + 1);

  // Without its manifest it is not there yet.
  fs::remove(manifest);
  const Reloaded half = Reload(AdminAddress(*server));
  EXPECT_TRUE(half.status.ok()) << half.status.error_message();
  EXPECT_FALSE(half.response.switched());
  EXPECT_THAT(server->Log(), HasSubstr("\"event\":\"model version skipped\""));
  EXPECT_EQ(server->Metric("stance_model_reload_success"), 1);

  InstallOther("3");
  EXPECT_TRUE(Reload(AdminAddress(*server)).response.switched());
  EXPECT_EQ(ServedVersion(channel), "3");
  // Back by hand: the higher version taken away.
  fs::rename(Version("3"), Version("3.bad"));
  EXPECT_TRUE(Reload(AdminAddress(*server)).response.switched());
  EXPECT_EQ(ServedVersion(channel), "1");
}

TEST_F(ReloadTest, APinnedVersionIsServed) {
  InstallOther("2");
  auto server = Start({"--model-versions", "untrained=1"});
  ASSERT_NE(server, nullptr);
  EXPECT_EQ(ServedVersion(ChannelTo(server->address())), "1");
}

// The models' own memory is freed, and what the allocator keeps does not grow.
TEST_F(ReloadTest, AHundredReloadsTakeNoMemory) {
  auto server = Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(server->address());
  const std::string admin = AdminAddress(*server);
  const auto written = fs::last_write_time(Version("1") / "manifest.json");
  const auto resident_after = [&](int first, int last) {
    for (int i = first; i < last; ++i) {
      fs::last_write_time(Version("1") / "manifest.json", written + std::chrono::seconds(i + 1));
      EXPECT_TRUE(Reload(admin).response.switched());
      if (i % 5 == 0) {
        EXPECT_FALSE(Transfer(channel).empty());
      }
    }
    return server->Metric("process_resident_memory_bytes");
  };
  const double early = resident_after(0, 10);
  const double late = resident_after(10, 110);
  RecordProperty("resident_after_10", std::to_string(early));
  RecordProperty("resident_after_110", std::to_string(late));
  EXPECT_LE(late, early * 1.05);
}

TEST_F(ReloadTest, OnlyAdministratorsMayReload) {
  const auto table = [](const std::string& name, const std::string& token, const std::string& more) {
    return "[clients." + name + "]\ntoken_sha256 = \"" + ToHex(Sha256(token)) + "\"\n" + more;
  };
  ASSERT_TRUE(WriteFile(root_ / "tokens.toml",
                        table("studio", "plain-token", "") + table("ops", "ops-token", "admin = true\n"))
                  .ok());
  auto server = Start({"--auth-token-file", root_ / "tokens.toml"});
  ASSERT_NE(server, nullptr);
  const std::string admin = AdminAddress(*server);
  const Reloaded none = Reload(admin), wrong = Reload(admin, "no-token"),
                 plain = Reload(admin, "plain-token");
  EXPECT_EQ(ReasonOf(none.status), "TOKEN_MISSING");
  EXPECT_EQ(ReasonOf(wrong.status), "TOKEN_UNKNOWN");
  EXPECT_EQ(plain.status.error_code(), grpc::PERMISSION_DENIED);
  EXPECT_EQ(ReasonOf(plain.status), "NOT_ADMIN");
  EXPECT_TRUE(Reload(admin, "ops-token").status.ok());
}

TEST_F(ReloadTest, TheServicesPortsDoNotServeAdministration) {
  auto server = Start();
  ASSERT_NE(server, nullptr);
  EXPECT_EQ(Reload(server->address()).status.error_code(), grpc::UNIMPLEMENTED);
  auto closed = MeasuredServer::Start();
  ASSERT_NE(closed, nullptr);
  EXPECT_EQ(AdminAddress(*closed), "");
  EXPECT_EQ(Reload(closed->address()).status.error_code(), grpc::UNIMPLEMENTED);
}

// --- The end.

grpc::health::v1::HealthCheckResponse::ServingStatus HealthOf(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::ClientContext context;
  grpc::health::v1::HealthCheckResponse response;
  EXPECT_TRUE(grpc::health::v1::Health::NewStub(channel)->Check(&context, {}, &response).ok());
  return response.status();
}

// One has been answered and reads nothing, one has begun a call and sends nothing, one is only connected.
TEST(DrainTest, ClientsThatHangDoNotKeepTheServer) {
  auto server = MeasuredServer::Start({"--inference-workers", "1", "--server-drain-timeout-seconds", "0.5"});
  ASSERT_NE(server, nullptr);
  const auto idle = ChannelTo(server->address()), half = ChannelTo(server->address());
  EXPECT_EQ(HealthOf(idle), grpc::health::v1::HealthCheckResponse::SERVING);
  grpc::GenericStub stub(half);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  auto begun = stub.PrepareCall(&context, "/stance.v1.PoseTransferService/Transfer", &queue);
  void* tag = nullptr;
  bool ok = false;
  begun->StartCall(nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok) && ok);

  BackgroundProgram reader({STANCE_HELD_CLIENT_BINARY, server->address()},
                           ::testing::TempDir() + "hanging-client-" + std::to_string(getpid()));
  server->AwaitMetric("stance_running_requests", 1);
  reader.Signal(SIGSTOP);
  server->AwaitMetric("stance_requests_total{code=\"OK\",rpc=\"Transfer\"}", 1);
  // 1 where gRPC still holds a part of the answer that nobody takes, 0 where the kernel has all of it.
  EXPECT_LE(server->Stop(), 1);
  EXPECT_THAT(server->Log(), HasSubstr(R"("event":"stopped")"));

  grpc::Status status;
  begun->Finish(&status, nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok));
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
}

TEST(DrainTest, TheLameDuckServesOn) {
  auto server = MeasuredServer::Start({"--server-lame-duck-seconds", "5"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(server->address());
  grpc::ClientContext context;
  const auto watch = grpc::health::v1::Health::NewStub(channel)->Watch(&context, {});
  grpc::health::v1::HealthCheckResponse response;
  ASSERT_TRUE(watch->Read(&response));
  server->Signal(SIGTERM);
  ASSERT_TRUE(watch->Read(&response));
  EXPECT_EQ(response.status(), grpc::health::v1::HealthCheckResponse::NOT_SERVING);
  EXPECT_FALSE(Transfer(channel).empty());
  EXPECT_EQ(server->Stop(), 0);
}

}  // namespace
}  // namespace stance
