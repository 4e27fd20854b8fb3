#include "core/base/clock.h"

namespace stance {
namespace {

class SteadyClock : public Clock {
 public:
  TimePoint Now() override { return std::chrono::steady_clock::now(); }

  void WaitUntil(std::condition_variable& condition, std::unique_lock<std::mutex>& lock,
                 TimePoint when) override {
    // wait_until(max) overflows in some libraries' conversion to another clock, so "never" is a plain wait.
    if (when == kNever) {
      condition.wait(lock);
    } else {
      condition.wait_until(lock, when);
    }
  }
};

}  // namespace

Clock& RealClock() {
  static SteadyClock clock;
  return clock;
}

}  // namespace stance
