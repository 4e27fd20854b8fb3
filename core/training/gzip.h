// Whole-buffer zlib.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/base/status.h"

namespace stance {

// The content of a gzip or zlib stream. DATA_LOSS for a damaged stream or one that unpacks to more than
// `max_bytes`.
absl::StatusOr<std::string> Decompress(std::string_view compressed, size_t max_bytes);

// A zlib stream at the highest level.
std::string Compress(std::string_view bytes);

}  // namespace stance
