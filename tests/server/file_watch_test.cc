#include "server/file_watch.h"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>

#include "core/base/files.h"

namespace stance {
namespace {

namespace fs = std::filesystem;

class FileWatchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("stance-watch-") +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(folder_ / "file") << "old";
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Whether the file, read at some call back, says "new": the last call may come before its content.
  std::unique_ptr<FileWatch> Watch() {
    auto watch = FileWatch::Start(folder_ / "file", [this] {
      const auto text = ReadFile(folder_ / "file");
      const std::lock_guard<std::mutex> guard(mutex_);
      seen_ = seen_ || (text.ok() && *text == "new");
      changed_.notify_all();
    });
    EXPECT_TRUE(watch.ok()) << watch.status();
    return *std::move(watch);
  }
  bool AwaitNew() {
    std::unique_lock<std::mutex> lock(mutex_);
    return changed_.wait_for(lock, std::chrono::minutes(1), [this] { return seen_; });
  }

  fs::path folder_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool seen_ = false;  // protected by mutex_
};

TEST_F(FileWatchTest, SeesAFileThatIsWritten) {
  const auto watch = Watch();
  std::ofstream(folder_ / "file") << "new";
  EXPECT_TRUE(AwaitNew());
}

TEST_F(FileWatchTest, SeesAFileThatIsReplaced) {
  const auto watch = Watch();
  ASSERT_TRUE(WriteFile(folder_ / "file", "new").ok());
  EXPECT_TRUE(AwaitNew());
}

// As Kubernetes mounts secrets: file -> ..data/file, ..data -> a folder; an update renames a new link into
// the place of ..data.
TEST_F(FileWatchTest, SeesALinkThatIsReplaced) {
  for (const char* version : {"1", "2"}) fs::create_directories(folder_ / version);
  fs::rename(folder_ / "file", folder_ / "1" / "file");
  std::ofstream(folder_ / "2" / "file") << "new";
  fs::create_directory_symlink("1", folder_ / "..data");
  fs::create_symlink("..data/file", folder_ / "file");
  const auto watch = Watch();
  fs::create_directory_symlink("2", folder_ / "..data_tmp");
  fs::rename(folder_ / "..data_tmp", folder_ / "..data");
  EXPECT_TRUE(AwaitNew());
}

TEST_F(FileWatchTest, AFolderThatIsNotThereIsAnError) {
  const auto watch = FileWatch::Start(folder_ / "nowhere" / "file", [] {});
  EXPECT_EQ(watch.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(std::string(watch.status().message()).find("nowhere"), std::string::npos);
}

}  // namespace
}  // namespace stance
