#include "core/network/model_files.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/files.h"

namespace stance {
namespace {

using nlohmann::json;

constexpr int kFormatVersion = 1;
constexpr char kManifestName[] = "manifest.json";

std::string Crc32(std::string_view bytes) {
  const auto value = crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return fmt::format("{:08x}", static_cast<uint32_t>(value));
}

// The object "confidence" of a manifest. A misspelt key would leave the model uncalibrated: an error.
absl::StatusOr<ConfidenceCalibration> ReadCalibration(const json& object) {
  if (!object.is_object()) {
    return absl::InvalidArgumentError(fmt::format("confidence = {} is not an object", object.dump()));
  }
  ConfidenceCalibration calibration;
  for (const auto& [key, value] : object.items()) {
    if (key != "scale" && key != "bias") {
      return absl::InvalidArgumentError(fmt::format("confidence.{} is unknown", key));
    }
    if (!value.is_number()) {
      return absl::InvalidArgumentError(fmt::format("confidence.{} = {} is not a number", key, value.dump()));
    }
    (key == "scale" ? calibration.scale : calibration.bias) = value.get<double>();
  }
  STANCE_RETURN_IF_ERROR(CheckCalibration(calibration));
  return calibration;
}

}  // namespace

absl::Status CheckCalibration(const ConfidenceCalibration& calibration) {
  if (!std::isfinite(calibration.scale) || calibration.scale <= 0) {
    return absl::InvalidArgumentError(
        fmt::format("confidence.scale = {} is not a finite number above 0", calibration.scale));
  }
  if (!std::isfinite(calibration.bias)) {
    return absl::InvalidArgumentError(fmt::format("confidence.bias = {} is not finite", calibration.bias));
  }
  return absl::OkStatus();
}

absl::StatusOr<ModelManifest> ReadManifest(const std::filesystem::path& dir) {
  const auto path = dir / kManifestName;
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  const auto bad = [&](const std::string& why) {
    return absl::InvalidArgumentError(fmt::format("{}: {}", path.string(), why));
  };
  json manifest;
  ModelManifest result;
  try {
    manifest = json::parse(text);
    if (!manifest.is_object()) return bad("not a JSON object");
    if (manifest.at("format_version").get<int>() != kFormatVersion) return bad("format_version is not 1");
    if (manifest.at("skeleton").get<std::string>() != "human24") return bad("skeleton is not 'human24'");
    result.name = manifest.at("name").get<std::string>();
    result.version = manifest.at("version").get<std::string>();
    result.method = manifest.at("method").get<std::string>();
    result.samples = manifest.at("samples").get<int64_t>();
    result.max_ring = manifest.at("max_ring").get<int>();
    result.weights = manifest.at("weights").get<std::string>();
    result.crc32 = manifest.at("crc32").get<std::string>();
  } catch (const json::exception& error) {
    return bad(error.what());
  }
  if (result.method != kSkeletalMethod && result.method != kStanceMethod && result.method != kNeuralMethod)
    return bad(fmt::format("method '{}' is unknown", result.method));
  if (result.samples < 64 || result.samples > 100'000)
    return bad(fmt::format("samples = {}", result.samples));
  if (result.max_ring < 1 || result.max_ring > 64) return bad(fmt::format("max_ring = {}", result.max_ring));
  if (std::filesystem::path(result.weights).filename() != result.weights)
    return bad("weights is not a file name");
  if (manifest.contains("features")) {
    if (result.method != kStanceMethod)
      return bad(fmt::format("features: those of the method '{}' are fixed", result.method));
    try {
      result.features.normals = manifest.at("features").at("normals").get<bool>();
      result.features.geodesic = manifest.at("features").at("geodesic").get<bool>();
    } catch (const json::exception& error) {
      return bad(fmt::format("features: {}", error.what()));
    }
  }
  if (manifest.contains("confidence")) {
    if (result.method != kStanceMethod)
      return bad(fmt::format("confidence: the method '{}' has none", result.method));
    const auto calibration = ReadCalibration(manifest.at("confidence"));
    if (!calibration.ok()) return bad(std::string(calibration.status().message()));
    result.confidence = *calibration;
  }
  return result;
}

absl::StatusOr<TensorMap> ReadWeights(const std::filesystem::path& dir, const ModelManifest& manifest) {
  const auto path = dir / manifest.weights;
  STANCE_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path));
  if (const std::string crc = Crc32(bytes); crc != manifest.crc32) {
    return absl::DataLossError(
        fmt::format("{}: crc32 is {}, the manifest says {}", path.string(), crc, manifest.crc32));
  }
  auto tensors = ParseTensors(bytes);
  if (!tensors.ok()) {
    return absl::DataLossError(fmt::format("{}: {}", path.string(), std::string(tensors.status().message())));
  }
  return tensors;
}

absl::Status WriteModel(const std::filesystem::path& dir, ModelManifest manifest, const TensorMap& tensors) {
  std::error_code error;
  std::filesystem::create_directories(dir, error);
  if (error) return absl::PermissionDeniedError(fmt::format("{}: {}", dir.string(), error.message()));
  const std::string bytes = SerializeTensors(tensors);
  manifest.crc32 = Crc32(bytes);
  STANCE_RETURN_IF_ERROR(WriteFile(dir / manifest.weights, bytes));
  json text = {
      {"format_version", kFormatVersion}, {"name", manifest.name},       {"version", manifest.version},
      {"method", manifest.method},        {"skeleton", "human24"},       {"samples", manifest.samples},
      {"max_ring", manifest.max_ring},    {"weights", manifest.weights}, {"crc32", manifest.crc32}};
  if (manifest.features != InputFeatures{}) {
    text["features"] = {{"normals", manifest.features.normals}, {"geodesic", manifest.features.geodesic}};
  }
  if (manifest.confidence != ConfidenceCalibration{}) {
    text["confidence"] = {{"scale", manifest.confidence.scale}, {"bias", manifest.confidence.bias}};
  }
  return WriteFile(dir / kManifestName, text.dump(2) + "\n");
}

}  // namespace stance
