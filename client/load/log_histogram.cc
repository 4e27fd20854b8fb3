#include "client/load/log_histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/check.h"

namespace stance {
namespace {

constexpr int kBits = 7;                       // 2^7 buckets per power of two
constexpr int64_t kSub = int64_t{1} << kBits;  // 128

// Values below 2 * kSub are their own bucket; a value with its highest bit at e >= kBits + 1 keeps its kBits
// + 1 leading bits.
int64_t BucketOf(int64_t value) {
  if (value < 2 * kSub) return value;
  const int shift = std::bit_width(static_cast<uint64_t>(value)) - (kBits + 1);
  return shift * kSub + (value >> shift);
}

// The largest value of a bucket.
int64_t LastOf(int64_t bucket) {
  if (bucket < 2 * kSub) return bucket;
  const int64_t shift = bucket / kSub - 1;
  // Unsigned: the end of the last bucket is 2^63.
  return static_cast<int64_t>((static_cast<uint64_t>(bucket - shift * kSub + 1) << shift) - 1);
}

}  // namespace

LogHistogram::LogHistogram() : buckets_(BucketOf(INT64_MAX) + 1) {}

void LogHistogram::Add(int64_t nanoseconds) {
  const int64_t value = std::max<int64_t>(nanoseconds, 0);
  ++buckets_[BucketOf(value)];
  min_ = count_ == 0 ? value : std::min(min_, value);
  max_ = std::max(max_, value);
  sum_ += static_cast<double>(value);
  ++count_;
}

void LogHistogram::Merge(const LogHistogram& other) {
  if (other.count_ == 0) return;
  for (size_t b = 0; b < buckets_.size(); ++b) buckets_[b] += other.buckets_[b];
  min_ = count_ == 0 ? other.min_ : std::min(min_, other.min_);
  max_ = std::max(max_, other.max_);
  sum_ += other.sum_;
  count_ += other.count_;
}

int64_t LogHistogram::Quantile(double q) const {
  STANCE_CHECK(q >= 0.0 && q <= 1.0);
  if (count_ == 0) return 0;
  const auto rank =
      std::clamp<int64_t>(static_cast<int64_t>(std::ceil(q * static_cast<double>(count_))), 1, count_);
  int64_t seen = 0;
  for (size_t b = 0; b < buckets_.size(); ++b) {
    seen += buckets_[b];
    if (seen >= rank) return std::min(LastOf(static_cast<int64_t>(b)), max_);
  }
  return max_;
}

}  // namespace stance
