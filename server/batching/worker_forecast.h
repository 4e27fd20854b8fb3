// When a worker will be free, as far as expected durations tell.
#pragma once

#include <cstdint>
#include <map>

#include "core/base/clock.h"

namespace stance {

// The batches that run, and when each is expected to end; one that takes longer than expected is expected to
// end at once. Not thread-safe.
class WorkerForecast {
 public:
  // REQUIRES: workers >= 1.
  explicit WorkerForecast(int workers) : workers_(workers) {}

  void Start(uint64_t batch, TimePoint expected_end) { ends_[batch] = expected_end; }
  void Finish(uint64_t batch) { ends_.erase(batch); }

  bool has_free_worker() const { return static_cast<int>(ends_.size()) < workers_; }

  // When a worker will be free for the next item, if `ahead` is done before it by all workers, each of which
  // begins when its batch has ended: the t at which sum_w max(0, t - free_w) = ahead.
  TimePoint FreeAfter(TimePoint now, Duration ahead) const;

 private:
  const int workers_;
  std::map<uint64_t, TimePoint> ends_;
};

}  // namespace stance
