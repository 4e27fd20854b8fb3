#include "core/network/model_digests.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/base/sha256.h"

namespace stance {
namespace {

using nlohmann::ordered_json;

constexpr char kManifestName[] = "manifest.json";
constexpr char kKey[] = "sha256";

absl::StatusOr<ordered_json> ReadJson(const std::filesystem::path& path) {
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  ordered_json manifest = ordered_json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!manifest.is_object()) {
    return absl::InvalidArgumentError(fmt::format("{}: not a JSON object", path.string()));
  }
  return manifest;
}

}  // namespace

absl::Status CheckDigests(const std::filesystem::path& dir) {
  const auto path = dir / kManifestName;
  STANCE_ASSIGN_OR_RETURN(const ordered_json manifest, ReadJson(path));
  if (!manifest.contains(kKey)) return absl::OkStatus();
  const ordered_json& digests = manifest[kKey];
  if (!digests.is_object()) {
    return absl::InvalidArgumentError(fmt::format("{}: sha256 is not an object", path.string()));
  }
  for (const auto& [name, digest] : digests.items()) {
    if (!digest.is_string() || std::filesystem::path(name).filename() != name) {
      return absl::InvalidArgumentError(
          fmt::format("{}: sha256.{} is not the digest of a file here", path.string(), name));
    }
    STANCE_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(dir / name));
    if (const std::string found = ToHex(Sha256(bytes)); found != digest.get<std::string>()) {
      return absl::DataLossError(fmt::format("{}: sha256 is {}, the manifest says {}", (dir / name).string(),
                                             found, digest.get<std::string>()));
    }
  }
  return absl::OkStatus();
}

absl::Status WriteDigests(const std::filesystem::path& dir, const std::vector<std::string>& files) {
  const auto path = dir / kManifestName;
  STANCE_ASSIGN_OR_RETURN(ordered_json manifest, ReadJson(path));
  ordered_json digests = ordered_json::object();
  for (const std::string& file : files) {
    STANCE_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(dir / file));
    digests[file] = ToHex(Sha256(bytes));
  }
  manifest[kKey] = digests;
  return WriteFile(path, manifest.dump(2) + "\n");
}

}  // namespace stance
