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
  // Counts a call in. False once closed: the call is then not counted and must not Leave.
  [[nodiscard]] bool Enter() {
    std::lock_guard<std::mutex> guard(mutex_);
    if (closed_) return false;
    ++count_;
    return true;
  }
  // REQUIRES: Enter returned true. Notifies under the mutex, so that a waiter may destroy this object once it
  // has seen none.
  void Leave() {
    std::lock_guard<std::mutex> guard(mutex_);
    if (--count_ == 0) none_.notify_all();
  }
  // Counts no further call, so that AwaitNone ends when those under way have left, whoever comes after them.
  void Close() {
    std::lock_guard<std::mutex> guard(mutex_);
    closed_ = true;
  }
  // True once there are none; false if there still are some at `deadline`.
  bool AwaitNone(TimePoint deadline) {
    std::unique_lock<std::mutex> lock(mutex_);
    return none_.wait_until(lock, deadline, [this] { return count_ == 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable none_;
  int64_t count_ = 0;  // protected by mutex_, as is closed_
  bool closed_ = false;
};

}  // namespace stance
