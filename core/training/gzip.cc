#include "core/training/gzip.h"

#include <fmt/format.h>
#include <zlib.h>

#include <array>

#include "core/base/check.h"

namespace stance {

absl::StatusOr<std::string> Decompress(std::string_view compressed, size_t max_bytes) {
  z_stream stream = {};
  STANCE_CHECK(inflateInit2(&stream, 15 + 32) == Z_OK);  // 32: recognise gzip and zlib headers
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(compressed.data()));
  stream.avail_in = static_cast<uInt>(compressed.size());
  std::string content;
  std::array<char, 1 << 16> chunk;
  int result = Z_OK;
  while (result == Z_OK && content.size() <= max_bytes) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    result = inflate(&stream, Z_NO_FLUSH);
    content.append(chunk.data(), chunk.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (content.size() > max_bytes) {
    return absl::DataLossError(fmt::format("unpacks to more than {} bytes", max_bytes));
  }
  if (result != Z_STREAM_END) return absl::DataLossError(fmt::format("damaged zlib stream ({})", result));
  return content;
}

std::string Compress(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string compressed(size, '\0');
  STANCE_CHECK(compress2(reinterpret_cast<Bytef*>(compressed.data()), &size,
                         reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 9) == Z_OK);
  compressed.resize(size);
  return compressed;
}

}  // namespace stance
