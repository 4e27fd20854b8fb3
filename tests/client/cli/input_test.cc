#include "client/cli/input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "client/cli/exit_code.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

TEST(NameFileTest, PutsThePathBeforeItsFieldAndKeepsTheExitCode) {
  const absl::Status status = FileError(absl::InvalidArgumentError("reference.arrays: bad"));
  const absl::Status named = NameFile(status, {{"source", "a.obj"}, {"reference", "b.obj"}});
  EXPECT_EQ(std::string(named.message()), "b.obj: reference.arrays: bad");
  EXPECT_EQ(named.code(), status.code());
  EXPECT_EQ(ExitCodeFor(named), ExitCode::kBadInput);
}

TEST(NameFileTest, LeavesOtherTextsAlone) {
  const absl::Status status = absl::InvalidArgumentError("sourcery: bad");
  EXPECT_EQ(NameFile(status, {{"source", "a.obj"}}), status);
}

TEST(ReadInputTest, AMissingFileIsAFileErrorAndABadOneABadInput) {
  const absl::StatusOr<TriangleMesh> missing = ReadInput("none/such.obj");
  EXPECT_EQ(ExitCodeFor(missing.status()), ExitCode::kFile);
  EXPECT_THAT(std::string(missing.status().message()), HasSubstr("none/such.obj"));
  const std::string path = testing::TempDir() + "input_test.glb";
  std::ofstream(path) << "not a GLB";
  const absl::StatusOr<TriangleMesh> bad = ReadInput(path);
  EXPECT_EQ(ExitCodeFor(bad.status()), ExitCode::kBadInput);
  EXPECT_THAT(std::string(bad.status().message()), HasSubstr(path));
  std::filesystem::remove(path);
}

TEST(CheckInputTest, NamesTheFile) {
  const absl::StatusOr<MeshReport> report = CheckInput("a.obj", TriangleMesh());
  EXPECT_EQ(ExitCodeFor(report.status()), ExitCode::kBadInput);
  EXPECT_THAT(std::string(report.status().message()), HasSubstr("a.obj: "));
}

}  // namespace
}  // namespace stance
