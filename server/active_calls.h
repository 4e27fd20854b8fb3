// How many calls are under way.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

#include "core/base/clock.h"

namespace stance {

// Thread-safe.
class ActiveCalls {
 public:
  void Enter() {
    std::lock_guard<std::mutex> guard(mutex_);
    ++count_;
  }
  // Notifies under the mutex, so that a waiter may destroy this object once it has seen none.
  void Leave() {
    std::lock_guard<std::mutex> guard(mutex_);
    if (--count_ == 0) none_.notify_all();
  }
  // True once there are none; false if there still are some at `deadline`.
  bool AwaitNone(TimePoint deadline) {
    std::unique_lock<std::mutex> lock(mutex_);
    return none_.wait_until(lock, deadline, [this] { return count_ == 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable none_;
  int64_t count_ = 0;  // protected by mutex_
};

}  // namespace stance
