#include "core/network/model_files.h"

#include <gtest/gtest.h>

#include "core/base/files.h"

namespace stance {
namespace {

class ModelFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    dir_ = std::filesystem::path(::testing::TempDir()) /
           ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(dir_);
    ModelManifest manifest;
    manifest.name = "tiny";
    manifest.version = "3";
    manifest.samples = 256;
    ASSERT_TRUE(WriteModel(dir_, manifest, {{"a", torch::ones({2})}}).ok());
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }
  std::filesystem::path dir_;
};

TEST_F(ModelFiles, WhatIsWrittenIsRead) {
  const auto manifest = ReadManifest(dir_);
  ASSERT_TRUE(manifest.ok()) << manifest.status();
  EXPECT_EQ(manifest->name, "tiny");
  EXPECT_EQ(manifest->version, "3");
  EXPECT_EQ(manifest->samples, 256);
  const auto tensors = ReadWeights(dir_, *manifest);
  ASSERT_TRUE(tensors.ok()) << tensors.status();
  EXPECT_TRUE(tensors->at("a").equal(torch::ones({2})));
}

TEST_F(ModelFiles, AFlippedByteIsDataLossWithThePath) {
  std::string bytes = *ReadFile(dir_ / "weights.safetensors");
  bytes.back() ^= 1;
  ASSERT_TRUE(WriteFile(dir_ / "weights.safetensors", bytes).ok());
  const auto status = ReadWeights(dir_, *ReadManifest(dir_)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(std::string(status.message()).find(dir_.string()), std::string::npos);
}

TEST_F(ModelFiles, ManifestErrorsSayWhat) {
  const std::string good = *ReadFile(dir_ / "manifest.json");
  for (const auto& [from, to] :
       {std::pair{"\"samples\": 256", "\"samples\": -1"}, std::pair{"\"skeletal\"", "\"astral\""},
        std::pair{"\"format_version\": 1", "\"format_version\": 9"},
        std::pair{"\"weights.safetensors\"", "\"../weights\""}, std::pair{"\"name\"", "\"nom\""},
        std::pair{"{", "["}}) {
    std::string bad = good;
    bad.replace(bad.find(from), std::string(from).size(), to);
    ASSERT_TRUE(WriteFile(dir_ / "manifest.json", bad).ok());
    EXPECT_EQ(ReadManifest(dir_).status().code(), absl::StatusCode::kInvalidArgument) << to;
  }
}

TEST_F(ModelFiles, AMissingModelIsNotFound) {
  EXPECT_EQ(ReadManifest(dir_ / "nowhere").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace stance
