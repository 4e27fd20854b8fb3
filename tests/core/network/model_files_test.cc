#include "core/network/model_files.h"

#include <gtest/gtest.h>

#include <limits>

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

// The manifest of a model of METHOD_STANCE with this member "confidence".
absl::StatusOr<ModelManifest> ReadWithConfidence(const std::filesystem::path& dir,
                                                 const std::string& confidence) {
  ModelManifest manifest;
  manifest.method = kStanceMethod;
  STANCE_RETURN_IF_ERROR(WriteModel(dir, manifest, {{"a", torch::ones({2})}}));
  STANCE_ASSIGN_OR_RETURN(std::string text, ReadFile(dir / "manifest.json"));
  text.replace(text.find('{'), 1, "{\"confidence\": " + confidence + ",");
  STANCE_RETURN_IF_ERROR(WriteFile(dir / "manifest.json", text));
  return ReadManifest(dir);
}

TEST_F(ModelFiles, ACalibrationIsReadAndWhatIsLeftOutChangesNothing) {
  EXPECT_EQ(ReadManifest(dir_)->confidence, ConfidenceCalibration());
  EXPECT_EQ(ReadWithConfidence(dir_, "{\"scale\": 0.5, \"bias\": -1}")->confidence,
            (ConfidenceCalibration{.scale = 0.5, .bias = -1}));
  EXPECT_EQ(ReadWithConfidence(dir_, "{\"bias\": 2}")->confidence,
            (ConfidenceCalibration{.scale = 1, .bias = 2}));
  EXPECT_EQ(ReadWithConfidence(dir_, "{}")->confidence, ConfidenceCalibration());
}

TEST_F(ModelFiles, ACalibrationThatIsWrittenIsRead) {
  ModelManifest manifest;
  manifest.method = kStanceMethod;
  manifest.confidence = {.scale = 0.8125, .bias = 0.1};
  ASSERT_TRUE(WriteModel(dir_, manifest, {{"a", torch::ones({2})}}).ok());
  EXPECT_EQ(ReadManifest(dir_)->confidence, manifest.confidence);
}

TEST_F(ModelFiles, FeaturesThatAreWrittenAreRead) {
  ModelManifest manifest;
  manifest.method = kStanceMethod;
  manifest.features = {.normals = false, .geodesic = true};
  ASSERT_TRUE(WriteModel(dir_, manifest, {{"a", torch::ones({2})}}).ok());
  EXPECT_EQ(ReadManifest(dir_)->features, manifest.features);
  std::string text = *ReadFile(dir_ / "manifest.json");
  text.replace(text.find("false"), 5, "\"no\"");
  ASSERT_TRUE(WriteFile(dir_ / "manifest.json", text).ok());
  const absl::Status status = ReadManifest(dir_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(status.message()).find("features"), std::string::npos) << status;
}

TEST_F(ModelFiles, CalibrationErrorsNameFieldAndValue) {
  for (const auto& [confidence, named] :
       {std::pair{"{\"scale\": -2}", "confidence.scale = -2"},
        std::pair{"{\"scale\": 0}", "confidence.scale = 0"},
        std::pair{"{\"bias\": \"low\"}", "confidence.bias = \"low\""},
        std::pair{"{\"bias\": 1e999}", "1e999"}, std::pair{"{\"skale\": 1}", "confidence.skale"},
        std::pair{"7", "confidence = 7"}}) {
    const absl::Status status = ReadWithConfidence(dir_, confidence).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << confidence;
    EXPECT_NE(std::string(status.message()).find(named), std::string::npos) << status;
    EXPECT_NE(std::string(status.message()).find(dir_.string()), std::string::npos) << status;
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_NE(std::string(CheckCalibration({.scale = kInfinity}).message()).find("confidence.scale = inf"),
            std::string::npos);
  EXPECT_NE(std::string(CheckCalibration({.bias = -kInfinity}).message()).find("confidence.bias = -inf"),
            std::string::npos);
}

TEST_F(ModelFiles, AMethodWithoutConfidenceHasNoCalibration) {
  std::string text = *ReadFile(dir_ / "manifest.json");
  text.replace(text.find('{'), 1, "{\"confidence\": {\"scale\": 2},");
  ASSERT_TRUE(WriteFile(dir_ / "manifest.json", text).ok());
  const absl::Status status = ReadManifest(dir_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(status.message()).find("'skeletal'"), std::string::npos) << status;
}

TEST_F(ModelFiles, AMissingModelIsNotFound) {
  EXPECT_EQ(ReadManifest(dir_ / "nowhere").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace stance
