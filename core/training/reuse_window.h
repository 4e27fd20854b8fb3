// Samples that cost more to make than to change: each comes several times, changed anew each time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/random.h"

namespace stance {

// The sample to show at place i of an endless stream in which each comes `reuse` times on average: number
// i / reuse where i is a multiple of reuse, else one of the kWindow before that. `make(number)` must always
// make the same. Thread-safe.
template <typename Sample>
class ReuseWindow {
 public:
  static constexpr int64_t kWindow = 4096;  // samples kept

  ReuseWindow(int64_t reuse, std::function<Sample(int64_t)> make)
      : reuse_(reuse), make_(std::move(make)), window_(kWindow) {
    STANCE_CHECK(reuse >= 1);
  }

  // `random` must depend on the place alone; what is left of it may serve to change the sample.
  std::shared_ptr<const Sample> At(int64_t place, Random& random) {
    int64_t number = place / reuse_;
    if (place % reuse_ != 0) number -= random.Below(std::min(number + 1, kWindow));
    return Made(number);
  }

 private:
  struct Slot {
    int64_t number = -1;
    std::shared_ptr<const Sample> sample;
  };

  std::shared_ptr<const Sample> Made(int64_t number) {
    Slot& slot = window_[number % kWindow];
    {
      const std::lock_guard lock(mutex_);
      if (slot.number == number) return slot.sample;
    }
    auto sample = std::make_shared<const Sample>(make_(number));
    const std::lock_guard lock(mutex_);
    if (slot.number < number) slot = {number, sample};
    return sample;
  }

  const int64_t reuse_;
  const std::function<Sample(int64_t)> make_;
  std::mutex mutex_;
  std::vector<Slot> window_;  // guarded by mutex_; number n in slot n % kWindow
};

}  // namespace stance
