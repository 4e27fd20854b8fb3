// Which folders hold the models to load, and which version of each. models/README.md describes the layout.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/base/status.h"

namespace stance {

// The version to take of the model in the folder of that name.
using VersionPins = std::map<std::string, int64_t>;

struct ModelFolders {
  std::vector<std::filesystem::path> models;   // folders with a manifest each; at least one
  std::vector<std::filesystem::path> skipped;  // versions without a manifest: not written to their end
};

// Each of `folders` is a model's own folder, holds versions of one (folders named by a positive number, the
// manifest of each saying that number), or holds such folders, taken by name. Of the versions the highest
// that is complete is taken, or the one that `pins` names. A folder without any model stands for itself, so
// that loading it says what it lacks. INVALID_ARGUMENT for a manifest beside versions or one that names
// another version, NOT_FOUND for a pin that fits nothing; with the path.
absl::StatusOr<ModelFolders> FindModelFolders(const std::vector<std::filesystem::path>& folders,
                                              const VersionPins& pins = {});

// Tells states of these folders apart: names, sizes and times of their files.
std::string StampOf(const std::vector<std::filesystem::path>& folders);

}  // namespace stance
