// A mergeable histogram of durations with a bounded relative error, as HdrHistogram does it.
#pragma once

#include <cstdint>
#include <vector>

namespace stance {

// Durations from 1 ns up, in buckets whose width is at most 1/128 of their value: below 256 ns exact, above
// that 128 equal buckets between each power of two and the next. Not thread-safe.
class LogHistogram {
 public:
  LogHistogram();

  // Negative values count as 0.
  void Add(int64_t nanoseconds);

  // As if every value of `other` had been added to this one.
  void Merge(const LogHistogram& other);

  int64_t count() const { return count_; }
  int64_t min() const { return count_ > 0 ? min_ : 0; }  // exact
  int64_t max() const { return max_; }                   // exact
  double mean() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : 0.0; }

  // The value of rank ceil(q * count), at most 1/128 above the true one and never above max(). 0 when empty.
  // REQUIRES: 0 <= q <= 1.
  int64_t Quantile(double q) const;

 private:
  std::vector<int64_t> buckets_;
  int64_t count_ = 0;
  int64_t min_ = 0;
  int64_t max_ = 0;
  double sum_ = 0;
};

}  // namespace stance
