// The SHA-256 of bytes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace stance {

using Sha256Digest = std::array<uint8_t, 32>;

Sha256Digest Sha256(std::string_view bytes);

// 64 lower-case hexadecimal digits.
std::string ToHex(const Sha256Digest& digest);

}  // namespace stance
