#include "server/access/token_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// SHA-256 of "abc" (FIPS 180-2, B.1) and of "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq" (B.2).
constexpr char kAbc[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr char kLong[] = "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1";

std::string Table(const std::string& entries) { return "[clients.studio]\n" + entries; }
std::string Digest(const std::string& digits) { return "token_sha256 = \"" + digits + "\"\n"; }

TEST(TokenTableTest, ReadsClients) {
  const auto clients =
      ParseTokenTable(Table(Digest(kAbc)) +
                      "requests_per_second = 10\nvertices_per_second = 2.5e6\n"
                      "admin = true\n[clients.night-shift_2]\ntoken_sha256 = [\"" +
                      std::string(kLong) + std::string("\", \"") + std::string(64, 'A') + "\"]\n");
  ASSERT_TRUE(clients.ok()) << clients.status();
  ASSERT_EQ(clients->size(), 2u);
  const bool first = (*clients)[0].name == "studio";
  const TokenClient& studio = (*clients)[first ? 0 : 1];
  const TokenClient& night = (*clients)[first ? 1 : 0];
  ASSERT_EQ(studio.tokens.size(), 1u);
  EXPECT_EQ(studio.tokens[0], Sha256("abc"));
  EXPECT_EQ(studio.requests_per_second, 10.0);
  EXPECT_EQ(studio.vertices_per_second, 2.5e6);
  EXPECT_TRUE(studio.admin);
  EXPECT_FALSE(night.admin);
  EXPECT_EQ(night.name, "night-shift_2");
  ASSERT_EQ(night.tokens.size(), 2u);
  EXPECT_EQ(night.tokens[0], Sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"));
  EXPECT_EQ(night.tokens[1][7], 0xaa);
  EXPECT_EQ(night.requests_per_second, std::nullopt);
}

struct BadTable {
  std::string text;
  std::string error;
};

TEST(TokenTableTest, RefusesWhatItDoesNotUnderstand) {
  const std::string empty_token = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
  const BadTable tables[] = {
      {"", "at least one table"},
      {"[clients]\n", "at least one table"},
      {"clients = 5\n", "[clients.NAME]"},
      {"[tokens.a]\n", "[clients.NAME]"},
      {"[clients.studio\n", "line 1: not TOML"},
      {"[clients]\nstudio = 5\n", "clients.studio: want a table"},
      {std::string("[clients.\"a b\"]\n") + Digest(kAbc), "client 1: want a name"},
      {std::string("[clients.\"") + std::string(65, 'a') + "\"]\n" + Digest(kAbc), "client 1: want a name"},
      {Table(""), "clients.studio: want token_sha256"},
      {Table("token_sha256 = []\n"), "clients.studio: want token_sha256"},
      {Table(Digest(kAbc) + std::string("admin = 1\n")), "clients.studio.admin: want true or false"},
      {Table("token_sha256 = 5\n"), "clients.studio.token_sha256: want 64"},
      {Table(Digest(std::string(kAbc).substr(1))), "clients.studio.token_sha256: want 64"},
      {Table(Digest(std::string("g") + std::string(kAbc).substr(1))), "clients.studio.token_sha256: want 64"},
      {Table(Digest(empty_token)), "clients.studio.token_sha256: want the SHA-256 of a token"},
      {Table(Digest(kAbc)) + "requests_per_second = 0\n", "clients.studio.requests_per_second: want"},
      {Table(Digest(kAbc)) + "requests_per_second = \"1\"\n", "clients.studio.requests_per_second: want"},
      {Table(Digest(kAbc)) + "requests_per_second = true\n", "clients.studio.requests_per_second: want"},
      {Table(Digest(kAbc)) + "vertices_per_second = nan\n", "clients.studio.vertices_per_second: want"},
      {Table(Digest(kAbc)) + "vertices_per_second = inf\n", "clients.studio.vertices_per_second: want"},
      {Table(Digest(kAbc)) + "speed = 3\n", "clients.studio: an unknown key"},
      {Table(Digest(kAbc)) + "[clients.other]\n" + Digest(kAbc), "not there twice"},
  };
  for (const BadTable& table : tables) {
    const absl::Status status = ParseTokenTable(table.text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << table.text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(table.error)) << table.text;
  }
}

// Wherever somebody puts a token instead of its digest, no error repeats it.
TEST(TokenTableTest, NoErrorRepeatsAToken) {
  const std::string token = "s3cret";
  for (const std::string& text :
       {token, token + " = 1\n", "[" + token + "]\n", "[clients]\n" + token + "\n", Table(Digest(token)),
        Table(Digest(token + std::string(58, '0'))), Table("token_sha256 = [\"" + token + "\"]\n"),
        Table("token_sha256 = " + token + "\n"), Table("token = \"" + token + "\"\n"),
        Table(Digest(kAbc) + token + " = 1\n"), Table("requests_per_second = \"" + token + "\"\n"),
        "[clients.\"" + token + "!\"]\n"}) {
    const absl::Status status = ParseTokenTable(text).status();
    EXPECT_FALSE(status.ok()) << text;
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr(token))) << text;
  }
}

}  // namespace
}  // namespace stance
