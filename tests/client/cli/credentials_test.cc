#include "client/cli/credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>

#include "client/cli/exit_code.h"
#include "core/base/files.h"

namespace stance {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class CredentialsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    unsetenv("STANCE_TOKEN");
    unsetenv("STANCE_TOKEN_FILE");
    folder_ = fs::path(::testing::TempDir()) /
              ("stance-credentials-" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    unsetenv("STANCE_TOKEN");
    unsetenv("STANCE_TOKEN_FILE");
    fs::remove_all(folder_);
  }

  std::string Put(const std::string& name, const std::string& text) const {
    EXPECT_TRUE(WriteFile(folder_ / name, text).ok());
    return folder_ / name;
  }
  // What the command line `words` means for a server on this machine.
  absl::StatusOr<ClientOptions> Read(const std::vector<std::string>& words) const {
    CLI::App app;
    CredentialArguments arguments;
    AddCredentials(&app, &arguments);
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    ClientOptions options;
    STANCE_RETURN_IF_ERROR(ReadCredentials(arguments, &options));
    return options;
  }

  fs::path folder_;
};

TEST_F(CredentialsTest, NothingIsPlain) {
  const auto options = Read({});
  ASSERT_TRUE(options.ok()) << options.status();
  EXPECT_FALSE(options->tls.has_value());
  EXPECT_EQ(options->token, "");
}

TEST_F(CredentialsTest, EachTlsOptionMeansTls) {
  EXPECT_TRUE(Read({"--tls"})->tls.has_value());
  EXPECT_EQ(Read({"--tls-name", "pose"})->tls->server_name, "pose");
  EXPECT_EQ(Read({"--tls-ca", Put("ca", "CA\n")})->tls->authorities, "CA\n");
  const auto mutual = Read({"--tls-cert", Put("cert", "CERT"), "--tls-key", Put("key", "KEY")});
  ASSERT_TRUE(mutual.ok()) << mutual.status();
  EXPECT_EQ(mutual->tls->certificate, "CERT");
  EXPECT_EQ(mutual->tls->key, "KEY");
  EXPECT_EQ(ExitCodeFor(Read({"--tls-cert", Put("cert", "CERT")}).status()), ExitCode::kUsage);
  EXPECT_EQ(ExitCodeFor(Read({"--tls-ca", folder_ / "nowhere"}).status()), ExitCode::kFile);
}

TEST_F(CredentialsTest, TheTokenComesFromAFileOrTheEnvironment) {
  const std::string first = Put("first", "token-1\n"), second = Put("second", " token-2 ");
  setenv("STANCE_TOKEN", "token-3\n", 1);
  EXPECT_EQ(Read({})->token, "token-3");
  setenv("STANCE_TOKEN_FILE", second.c_str(), 1);
  EXPECT_EQ(Read({})->token, "token-2");
  EXPECT_EQ(Read({"--token-file", first})->token, "token-1");
}

TEST_F(CredentialsTest, WhatIsNotATokenIsRefusedUnseen) {
  for (const char* text : {"", "\n", "two words", "caf\xc3\xa9"}) {
    const absl::Status status = Read({"--token-file", Put("token", text)}).status();
    EXPECT_EQ(ExitCodeFor(status), ExitCode::kBadInput) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("/token: not a token"));
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("words")));
  }
  EXPECT_EQ(ExitCodeFor(Read({"--token-file", folder_ / "nowhere"}).status()), ExitCode::kFile);
}

// Whatever the tools accept, the token itself is not among it.
TEST_F(CredentialsTest, NoOptionTakesTheTokenItself) {
  CLI::App app;
  CredentialArguments arguments;
  AddCredentials(&app, &arguments);
  EXPECT_EQ(app.get_option_no_throw("--token"), nullptr);
  EXPECT_THAT(app.help(), HasSubstr("--token-file"));
}

}  // namespace
}  // namespace stance
