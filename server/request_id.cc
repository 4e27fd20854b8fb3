#include "server/request_id.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <random>

#include "core/base/random.h"

namespace stance {
namespace {

constexpr size_t kMaxLength = 64;

uint64_t Seed() {
  std::random_device device;
  return (uint64_t{device()} << 32) | device();
}

}  // namespace

std::string MakeRequestId() {
  static std::mutex mutex;
  static Random random(Seed());
  uint64_t high, low;
  {
    std::lock_guard<std::mutex> guard(mutex);
    high = random.Next();
    low = random.Next();
  }
  // RFC 4122: version 4 in the high half, variant 1 in the low half.
  high = (high & ~uint64_t{0xf000}) | 0x4000;
  low = (low & ~(uint64_t{3} << 62)) | (uint64_t{2} << 62);
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", high >> 32, (high >> 16) & 0xffff, high & 0xffff,
                     low >> 48, low & 0xffffffffffff);
}

absl::StatusOr<std::string> ChooseRequestId(const std::string& requested) {
  if (requested.empty()) return MakeRequestId();
  if (requested.size() > kMaxLength) {
    return absl::InvalidArgumentError(
        fmt::format("{} characters; want at most {}", requested.size(), kMaxLength));
  }
  const auto bad =
      std::find_if(requested.begin(), requested.end(), [](char c) { return c < 0x20 || c > 0x7e; });
  if (bad != requested.end()) {
    return absl::InvalidArgumentError(fmt::format("byte 0x{:02x} at {} is not printable ASCII",
                                                  static_cast<unsigned char>(*bad), bad - requested.begin()));
  }
  return requested;
}

}  // namespace stance
