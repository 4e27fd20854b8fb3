// Monotonic time that tests can replace.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace stance {

using TimePoint = std::chrono::steady_clock::time_point;
using Duration = std::chrono::steady_clock::duration;

// "Never", as a deadline or a wake-up time.
inline constexpr TimePoint kNever = TimePoint::max();

// Seconds as a number, for metrics and answers.
inline double ToSeconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

// Where time comes from. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;

  virtual TimePoint Now() = 0;

  // Waits until `condition` is notified or Now() has reached `when` (kNever: no limit); may also return for
  // no reason. REQUIRES: `lock` is held; it is held again on return.
  virtual void WaitUntil(std::condition_variable& condition, std::unique_lock<std::mutex>& lock,
                         TimePoint when) = 0;
};

// The machine's steady clock.
Clock& RealClock();

}  // namespace stance
