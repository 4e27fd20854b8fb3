#include "client/cli/output_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace stance {
namespace {

namespace fs = std::filesystem;

class OutputFilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::path(::testing::TempDir()) / ::testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string Content(const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  int FileCount() const {
    return static_cast<int>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

TEST_F(OutputFilesTest, NothingIsVisibleBeforeTheCommit) {
  std::ofstream(folder_ / "a") << "old";
  OutputFiles files;
  ASSERT_TRUE(files.Stage(folder_ / "a", "new").ok());
  ASSERT_TRUE(files.Stage(folder_ / "b", std::string_view("x\0y", 3)).ok());
  EXPECT_EQ(Content(folder_ / "a"), "old");
  EXPECT_FALSE(fs::exists(folder_ / "b"));
  ASSERT_TRUE(files.Commit().ok());
  EXPECT_EQ(Content(folder_ / "a"), "new");
  EXPECT_EQ(Content(folder_ / "b"), std::string("x\0y", 3));
  EXPECT_EQ(FileCount(), 2);
}

TEST_F(OutputFilesTest, WithoutCommitNothingRemains) {
  {
    OutputFiles files;
    ASSERT_TRUE(files.Stage(folder_ / "a", "new").ok());
    EXPECT_EQ(FileCount(), 1);
  }
  EXPECT_EQ(FileCount(), 0);
}

TEST_F(OutputFilesTest, AFailedWriterLeavesNothing) {
  {
    OutputFiles files;
    const absl::Status status = files.StageWith(folder_ / "a", [](const fs::path& path) {
      std::ofstream(path) << "half";
      return absl::InternalError("writer");
    });
    EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  }
  EXPECT_EQ(FileCount(), 0);
}

TEST_F(OutputFilesTest, MissingFolderIsNotFound) {
  const absl::Status status = OutputFiles::Check(folder_ / "none" / "a.obj");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_NE(std::string(status.message()).find("none/a.obj"), std::string::npos);
}

TEST_F(OutputFilesTest, AFolderOrADeviceIsNotOverwritten) {
  EXPECT_EQ(OutputFiles::Check(folder_).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(OutputFiles::Check("/dev/null").code(), absl::StatusCode::kFailedPrecondition);
  OutputFiles files;
  EXPECT_EQ(files.Stage("/dev/null", "x").code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace stance
