// The SHA-256 of a model's files, as its manifest lists them. Free of Torch.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"

namespace stance {

// Compares every file that the manifest's object `sha256` ({"FILE": "64 hexadecimal digits"}) names; a
// manifest without it passes. INVALID_ARGUMENT for a malformed one, NOT_FOUND for a file that is missing,
// DATA_LOSS for one that differs; each with the path.
absl::Status CheckDigests(const std::filesystem::path& dir);

// Makes the manifest list these files as they are now, and no others. The rest of it stays.
absl::Status WriteDigests(const std::filesystem::path& dir, const std::vector<std::string>& files);

}  // namespace stance
