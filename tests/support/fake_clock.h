// A clock that moves only when a test says so.
#pragma once

#include <condition_variable>
#include <mutex>
#include <vector>

#include "core/base/clock.h"

namespace stance::testing {

// Thread-safe. Every waiter must have returned from WaitUntil before its condition variable is destroyed.
class FakeClock : public Clock {
 public:
  TimePoint Now() override {
    std::lock_guard<std::mutex> guard(mutex_);
    return now_;
  }

  void WaitUntil(std::condition_variable& condition, std::unique_lock<std::mutex>& lock,
                 TimePoint when) override {
    {
      std::lock_guard<std::mutex> guard(mutex_);
      if (now_ >= when) return;
      waiters_.push_back({&condition, lock.mutex()});
      ++waits_;
    }
    condition.wait(lock);
    std::lock_guard<std::mutex> guard(mutex_);
    for (size_t i = 0; i < waiters_.size(); ++i) {
      if (waiters_[i].condition == &condition) {
        waiters_.erase(waiters_.begin() + static_cast<std::ptrdiff_t>(i));
        break;
      }
    }
  }

  // Moves time and wakes every waiter. REQUIRES: the caller holds no waiter's mutex.
  void Advance(Duration by) {
    std::vector<Waiter> waiters;
    {
      std::lock_guard<std::mutex> guard(mutex_);
      now_ += by;
      waiters = waiters_;
    }
    for (const Waiter& waiter : waiters) {
      // A waiter that has registered but does not yet sleep still holds its mutex: wait for it to sleep.
      { std::lock_guard<std::mutex> asleep(*waiter.mutex); }
      waiter.condition->notify_all();
    }
  }

  // How many times anyone has gone to sleep so far.
  int waits() {
    std::lock_guard<std::mutex> guard(mutex_);
    return waits_;
  }

 private:
  struct Waiter {
    std::condition_variable* condition;
    std::mutex* mutex;
  };

  std::mutex mutex_;
  TimePoint now_ = TimePoint() + std::chrono::hours(1);  // protected by mutex_, as are the next two
  std::vector<Waiter> waiters_;
  int waits_ = 0;
};

}  // namespace stance::testing
