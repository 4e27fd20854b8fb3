#include "core/base/files.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace stance {
namespace {

TEST(Files, WhatIsWrittenIsRead) {
  const auto path = std::filesystem::path(::testing::TempDir()) / "files_test.bin";
  const std::string bytes("a\0b\nc", 5);
  ASSERT_TRUE(WriteFile(path, bytes).ok());
  const auto read = ReadFile(path);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(*read, bytes);
  std::filesystem::remove(path);
}

TEST(Files, MissingFileIsNotFoundAndNamed) {
  const auto read = ReadFile("/nonexistent/mesh.obj");
  EXPECT_EQ(read.status().code(), absl::StatusCode::kNotFound);
  EXPECT_NE(std::string(read.status().message()).find("/nonexistent/mesh.obj"), std::string::npos);
}

TEST(Files, DirectoryIsNotAFile) {
  EXPECT_EQ(ReadFile(::testing::TempDir()).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Files, FailedWriteLeavesNothingBehind) {
  const auto dir = std::filesystem::path(::testing::TempDir()) / "files_test_dir";
  std::filesystem::create_directories(dir / "target");  // a directory stands where the file should go
  EXPECT_FALSE(WriteFile(dir / "target", "x").ok());
  int entries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(dir)) entries += entry.exists();
  EXPECT_EQ(entries, 1);
  std::filesystem::remove_all(dir);
}

}  // namespace
}  // namespace stance
