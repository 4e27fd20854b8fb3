// What a model directory says of itself. Free of Torch.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/base/status.h"

namespace stance {

// ModelManifest::method.
inline constexpr char kSkeletalMethod[] = "skeletal";
inline constexpr char kStanceMethod[] = "stance";

// What models/<name>/manifest.json says.
struct ModelManifest {
  std::string name;
  std::string version;
  std::string method = kSkeletalMethod;
  int64_t samples = 1024;  // surface samples per mesh that the networks were trained on
  int max_ring = 12;
  std::string weights = "weights.safetensors";  // file beside the manifest
  std::string crc32;                            // of that file, eight hexadecimal digits
};

// NOT_FOUND or INVALID_ARGUMENT with the path.
absl::StatusOr<ModelManifest> ReadManifest(const std::filesystem::path& dir);

}  // namespace stance
