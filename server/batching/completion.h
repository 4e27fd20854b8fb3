// The answer that every batched item owes its caller.
#pragma once

#include <functional>
#include <utility>

#include "core/base/check.h"

namespace stance {

// What became of an item.
enum class Outcome {
  kExecuted,      // it ran; the result lies in its payload
  kQueueFull,     // refused: as many items wait as may
  kQueueBytes,    // refused: as many bytes wait as may
  kExpired,       // its deadline passed before a worker was free; it did not run
  kCancelled,     // its caller gave it up before a worker was free; it did not run
  kShuttingDown,  // refused or given back: the runner is stopping
};

// A callback that is called exactly once: a second call, or its destruction without one, is a bug of ours and
// aborts. Move-only; not thread-safe.
class Completion {
 public:
  Completion() = default;
  explicit Completion(std::function<void(Outcome)> callback) : callback_(std::move(callback)) {}
  Completion(Completion&& other) noexcept : callback_(std::exchange(other.callback_, nullptr)) {}
  Completion& operator=(Completion&& other) noexcept {
    STANCE_CHECK(callback_ == nullptr);
    callback_ = std::exchange(other.callback_, nullptr);
    return *this;
  }
  ~Completion() { STANCE_CHECK(callback_ == nullptr); }

  void operator()(Outcome outcome) {
    STANCE_CHECK(callback_ != nullptr);
    std::exchange(callback_, nullptr)(outcome);
  }

  // True until it has been called.
  bool pending() const { return callback_ != nullptr; }

 private:
  std::function<void(Outcome)> callback_;
};

}  // namespace stance
