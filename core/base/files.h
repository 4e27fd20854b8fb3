// Whole files in and out.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/status.h"

namespace stance {

// NOT_FOUND, PERMISSION_DENIED or UNAVAILABLE, with the path.
absl::StatusOr<std::string> ReadFile(const std::filesystem::path& path);

// Writes aside and renames, so that no reader ever sees half a file.
absl::Status WriteFile(const std::filesystem::path& path, std::string_view bytes);

}  // namespace stance
