// `stance-load` against the real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/mesh/mesh_io.h"
#include "tests/support/process.h"
#include "tests/support/puppet.h"
#include "tests/support/server_process.h"

namespace stance {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ProgramResult;

class LoadTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new testing::ServerProcess(); }
  static void TearDownTestSuite() {
    EXPECT_EQ(server_->Stop(), 0) << server_->Log();
    delete server_;
  }

  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("stance-load-" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::create_directories(folder_);
    mesh_ = (folder_ / "puppet.ply").string();
    ASSERT_TRUE(WriteMesh(testing::MakePuppet().mesh, mesh_).ok());
  }
  void TearDown() override { fs::remove_all(folder_); }

  ProgramResult Run(const std::vector<std::string>& more) const {
    std::vector<std::string> words = {STANCE_LOAD_BINARY, mesh_, mesh_, "--server", server_->address()};
    words.insert(words.end(), more.begin(), more.end());
    return testing::RunProgram(words);
  }

  static testing::ServerProcess* server_;
  fs::path folder_;
  std::string mesh_;
};

testing::ServerProcess* LoadTest::server_ = nullptr;

TEST_F(LoadTest, ClosedLoopAnswersEveryRequest) {
  const ProgramResult result =
      Run({"--clients", "2", "--requests", "7", "--duration", "0", "--warmup", "1", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["mode"], "closed");
  EXPECT_EQ(json["clients"], 2);
  EXPECT_EQ(json["planned"], 7);
  EXPECT_EQ(json["sent"], 7);
  EXPECT_EQ(json["unsent"], 0);
  EXPECT_EQ(json["ok"], 7);
  EXPECT_TRUE(json["errors"].empty());
  const auto& latency = json["latency_ms"];
  EXPECT_GT(latency["min"].get<double>(), 0.0);
  EXPECT_LE(latency["min"].get<double>(), latency["p50"].get<double>());
  EXPECT_LE(latency["p50"].get<double>(), latency["p90"].get<double>());
  EXPECT_LE(latency["p90"].get<double>(), latency["p99"].get<double>());
  EXPECT_LE(latency["p99"].get<double>(), latency["max"].get<double>());
}

TEST_F(LoadTest, OpenLoopSendsWhatItPlanned) {
  const ProgramResult result = Run({"--rate", "50", "--requests", "8", "--seed", "3", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["mode"], "open");
  EXPECT_EQ(json["planned"], 8);
  EXPECT_EQ(json["ok"], 8);
}

TEST_F(LoadTest, TextNamesTheQuantiles) {
  const ProgramResult result = Run({"--requests", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* word : {"closed loop", "2 sent", "p50", "p90", "p99", "max", "ok/s"}) {
    EXPECT_THAT(result.out, HasSubstr(word));
  }
}

TEST_F(LoadTest, ErrorsAreCountedByCode) {
  const ProgramResult result = Run({"--requests", "3", "--model", "nobody", "--json"});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_EQ(result.err, "stance-load: no request succeeded\n");
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["ok"], 0);
  EXPECT_EQ(json["errors"]["NOT_FOUND"], 3);
}

TEST_F(LoadTest, TheMethodIsTheServersUnlessChosen) {
  const auto run = [&](const std::string& method) {
    return Run({"--requests", "1", "--method", method, "--json"});
  };
  EXPECT_EQ(run("skeletal").exit_code, 0);
  const ProgramResult missing = run("stance");  // the server has no model of it
  EXPECT_EQ(missing.exit_code, 5);
  EXPECT_EQ(nlohmann::json::parse(missing.out)["errors"]["FAILED_PRECONDITION"], 1);
  const ProgramResult unknown = run("magic");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("--method"));
}

TEST_F(LoadTest, ExitCodes) {
  EXPECT_EQ(Run({"--rate", "5", "--clients", "2"}).exit_code, 2);
  EXPECT_EQ(Run({"--clients", "0"}).exit_code, 2);
  EXPECT_EQ(Run({"--rate", "nan"}).exit_code, 2);
  EXPECT_EQ(Run({"--duration", "0"}).exit_code, 2);
  EXPECT_EQ(Run({"--warmup", "1", "--model", "nobody"}).exit_code, 3);
  EXPECT_EQ(
      testing::RunProgram({STANCE_LOAD_BINARY, "none.obj", mesh_, "--server", server_->address()}).exit_code,
      4);
  // The server exists, but the name does not.
  EXPECT_EQ(testing::RunProgram({STANCE_LOAD_BINARY, mesh_, mesh_, "--server", "unix:/nonexistent/s.sock",
                                 "--timeout", "0.2", "--requests", "1"})
                .exit_code,
            5);
}

}  // namespace
}  // namespace stance
