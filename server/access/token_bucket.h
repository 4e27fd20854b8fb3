// A rate limit as a pure value: no clock inside.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/base/clock.h"

namespace stance {

// Lets `rate` units pass per second, after a pause at most one second's worth at once. What is larger than
// that passes when the bucket is full, and the next one waits until it is paid off, so that the mean rate
// holds for it too and yet nothing is too large to pass at all.
//
// Invariants: (1) what passes within any time t is at most rate * (t + 1 s), or rate * t and one that is
// larger; (2) the wait is exact: a nanosecond earlier would be refused; (3) asking changes nothing.
// The generic cell rate algorithm (ITU-T I.371) in whole nanoseconds: a cost is the time in which the rate
// pays it. Not thread-safe.
class TokenBucket {
 public:
  // REQUIRES: rate > 0.
  explicit TokenBucket(double rate) : rate_(rate) { STANCE_CHECK(rate > 0); }

  // How long from `now` until `units` may pass; zero: now. REQUIRES: units >= 0.
  Duration WaitFor(double units, TimePoint now) const {
    const Duration debt = std::max(paid_at_, now) - now;
    return std::max(debt + std::min(CostOf(units), kBurst) - kBurst, Duration::zero());
  }

  // Lets them pass. REQUIRES: WaitFor(units, now) is zero.
  void Take(double units, TimePoint now) { paid_at_ = std::max(paid_at_, now) + CostOf(units); }

  double rate() const { return rate_; }

 private:
  static constexpr Duration kBurst = std::chrono::seconds(1);
  // Beyond any process's life, and far enough from the end of the clock.
  static constexpr double kMostNanoseconds = 1e18;

  // Rounded up: down, many small ones would pass for nothing.
  Duration CostOf(double units) const {
    return Duration(static_cast<Duration::rep>(std::min(std::ceil(units / rate_ * 1e9), kMostNanoseconds)));
  }

  double rate_;
  TimePoint paid_at_ = TimePoint::min();  // when the bucket is full again
};

}  // namespace stance
