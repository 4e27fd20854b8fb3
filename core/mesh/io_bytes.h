// Numbers in and out of the binary formats, whatever the machine's own byte order and alignment.
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

namespace stance {

// REQUIRES: sizeof(T) readable bytes.
template <typename T>
T LoadEndian(const char* bytes, std::endian order) {
  char copy[sizeof(T)];
  std::memcpy(copy, bytes, sizeof(T));
  if (order != std::endian::native) std::reverse(copy, copy + sizeof(T));
  return std::bit_cast<T>(copy);
}

template <typename T>
T LoadLittleEndian(const char* bytes) {
  return LoadEndian<T>(bytes, std::endian::little);
}

template <typename T>
void AppendLittleEndian(T value, std::string& bytes) {
  char copy[sizeof(T)];
  std::memcpy(copy, &value, sizeof(T));
  if (std::endian::native != std::endian::little) std::reverse(copy, copy + sizeof(T));
  bytes.append(copy, sizeof(T));
}

}  // namespace stance
