#include "core/transfer/model_folders.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>
#include <system_error>

#include "core/network/model_manifest.h"

namespace stance {
namespace {

namespace fs = std::filesystem;

bool HoldsModel(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / "manifest.json", error);
}

// By name. None of a folder that can't be read: loading it says why.
std::vector<fs::path> FoldersIn(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error, ignored;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_directory(ignored)) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Of a folder that is called like a version: "7", not "07" or "7.old".
std::optional<int64_t> VersionOf(const fs::path& folder) {
  const std::string name = folder.filename().string();
  int64_t version = 0;
  const auto [rest, error] = std::from_chars(name.data(), name.data() + name.size(), version);
  if (error != std::errc() || version < 1 || name != std::to_string(version)) return std::nullopt;
  return version;
}

class Finder {
 public:
  explicit Finder(const VersionPins& pins) : pins_(pins) {}

  // Adds what is in `folder` if it is a model's; false if it is none.
  absl::StatusOr<bool> AddModel(const fs::path& folder) {
    std::map<int64_t, fs::path> versions;
    for (const fs::path& entry : FoldersIn(folder)) {
      if (const auto version = VersionOf(entry)) versions[*version] = entry;
    }
    if (HoldsModel(folder)) {
      if (!versions.empty()) {
        return absl::InvalidArgumentError(
            fmt::format("{}: a manifest beside versions such as {}; want one or the other", folder.string(),
                        versions.begin()->first));
      }
      found_.models.push_back(folder);
      return true;
    }
    if (versions.empty()) return false;
    for (auto it = versions.begin(); it != versions.end();) {
      if (HoldsModel(it->second)) {
        ++it;
      } else {
        found_.skipped.push_back(it->second);
        it = versions.erase(it);
      }
    }
    return AddVersion(folder, versions);
  }

  absl::StatusOr<ModelFolders> Finish() {
    for (const auto& [name, version] : pins_) {
      if (!pinned_.contains(name)) {
        return absl::NotFoundError(fmt::format("no model '{}' with versions to pin {} of", name, version));
      }
    }
    return std::move(found_);
  }

 private:
  absl::StatusOr<bool> AddVersion(const fs::path& folder, const std::map<int64_t, fs::path>& versions) {
    auto chosen = versions.empty() ? versions.end() : std::prev(versions.end());
    // "models/one/" has an empty last part.
    const fs::path whole = folder.has_filename() ? folder : folder.parent_path();
    if (const auto pin = pins_.find(whole.filename().string()); pin != pins_.end()) {
      pinned_.insert(pin->first);
      chosen = versions.find(pin->second);
      if (chosen == versions.end()) {
        return absl::NotFoundError(fmt::format("{}: no complete version {}", folder.string(), pin->second));
      }
    }
    if (chosen == versions.end()) return false;
    STANCE_ASSIGN_OR_RETURN(const ModelManifest manifest, ReadManifest(chosen->second));
    if (manifest.version != std::to_string(chosen->first)) {
      return absl::InvalidArgumentError(fmt::format("{}: the manifest's version is '{}', not the folder's",
                                                    chosen->second.string(), manifest.version));
    }
    found_.models.push_back(chosen->second);
    return true;
  }

  const VersionPins& pins_;
  std::set<std::string> pinned_;
  ModelFolders found_;
};

}  // namespace

absl::StatusOr<ModelFolders> FindModelFolders(const std::vector<fs::path>& folders, const VersionPins& pins) {
  Finder finder(pins);
  std::vector<fs::path> empty;
  for (const fs::path& folder : folders) {
    STANCE_ASSIGN_OR_RETURN(bool any, finder.AddModel(folder));
    if (any) continue;
    for (const fs::path& entry : FoldersIn(folder)) {
      STANCE_ASSIGN_OR_RETURN(const bool added, finder.AddModel(entry));
      any = any || added;
    }
    if (!any) empty.push_back(folder);
  }
  STANCE_ASSIGN_OR_RETURN(ModelFolders found, finder.Finish());
  found.models.insert(found.models.end(), empty.begin(), empty.end());
  return found;
}

std::string StampOf(const std::vector<fs::path>& folders) {
  std::set<std::string> lines;
  std::error_code error, ignored;
  for (const fs::path& folder : folders) {
    lines.insert(folder.string());  // also where there is none
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      lines.insert(fmt::format("{} {} {}", entry.path().string(), entry.file_size(ignored),
                               entry.last_write_time(ignored).time_since_epoch().count()));
    }
  }
  return fmt::format("{}", fmt::join(lines, "\n"));
}

}  // namespace stance
