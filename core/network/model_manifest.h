// What a model directory says of itself. Free of Torch.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/base/status.h"
#include "core/network/pyramid_input.h"

namespace stance {

// ModelManifest::method.
inline constexpr char kSkeletalMethod[] = "skeletal";
inline constexpr char kStanceMethod[] = "stance";
inline constexpr char kNeuralMethod[] = "neural";

// Platt scaling of a model's confidences: p becomes sigmoid(scale logit(p) + bias). What
// `stance-eval confidence` fits.
struct ConfidenceCalibration {
  double scale = 1;  // finite, > 0
  double bias = 0;   // finite
  bool operator==(const ConfidenceCalibration&) const = default;
};

// What models/<name>/manifest.json says.
struct ModelManifest {
  std::string name;
  std::string version;
  std::string method = kSkeletalMethod;
  int64_t samples = 1024;  // surface samples per mesh that the networks were trained on
  int max_ring = 12;
  InputFeatures features{};                     // kStanceMethod; may be left out of the file
  std::string weights = "weights.safetensors";  // file beside the manifest
  std::string crc32;                            // of that file, eight hexadecimal digits
  ConfidenceCalibration confidence;             // kStanceMethod; may be left out of the file
};

// INVALID_ARGUMENT, "confidence.scale = -1 ...", for a value out of its range.
absl::Status CheckCalibration(const ConfidenceCalibration& calibration);

// NOT_FOUND or INVALID_ARGUMENT with the path.
absl::StatusOr<ModelManifest> ReadManifest(const std::filesystem::path& dir);

}  // namespace stance
