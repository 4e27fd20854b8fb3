// The answer that every batched item owes its caller.
#pragma once

#include <functional>
#include <utility>

#include "core/base/check.h"
#include "core/base/clock.h"

namespace stance {

// What became of an item.
enum class Outcome {
  kExecuted,       // it ran; the result lies in its payload
  kQueueFull,      // refused: as many items wait as may
  kQueueBytes,     // refused: as many bytes wait as may
  kQueueCost,      // refused: as much cost waits as may
  kClientQuota,    // refused: as many items of its client wait as may
  kTooMuchAhead,   // refused: what is ahead of it is expected to last until its deadline
  kDeadlineShort,  // refused: it alone is expected to take longer than its deadline allows
  kExpired,        // its deadline passed before a worker was free; it did not run
  kCancelled,      // its caller gave it up before a worker was free; it did not run
  kShuttingDown,   // refused or given back: the runner is stopping
};

// A callback that is called exactly once: a second call, or its destruction without one, is a bug of ours and
// aborts. Move-only; not thread-safe.
class Completion {
 public:
  // `retry_after`: when it may be worth another try; 0 if unknown.
  using Callback = std::function<void(Outcome outcome, Duration retry_after)>;

  Completion() = default;
  explicit Completion(Callback callback) : callback_(std::move(callback)) {}
  // For callers who don't care when to try again.
  explicit Completion(std::function<void(Outcome)> callback)
      : callback_([callback = std::move(callback)](Outcome outcome, Duration) { callback(outcome); }) {}
  Completion(Completion&& other) noexcept : callback_(std::exchange(other.callback_, nullptr)) {}
  Completion& operator=(Completion&& other) noexcept {
    STANCE_CHECK(callback_ == nullptr);
    callback_ = std::exchange(other.callback_, nullptr);
    return *this;
  }
  ~Completion() { STANCE_CHECK(callback_ == nullptr); }

  void operator()(Outcome outcome, Duration retry_after = Duration(0)) {
    STANCE_CHECK(callback_ != nullptr);
    std::exchange(callback_, nullptr)(outcome, retry_after);
  }

  // True until it has been called.
  bool pending() const { return callback_ != nullptr; }

 private:
  Callback callback_;
};

}  // namespace stance
