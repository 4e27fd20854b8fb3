#include "server/batching/worker_forecast.h"

#include <algorithm>
#include <vector>

namespace stance {

TimePoint WorkerForecast::FreeAfter(TimePoint now, Duration ahead) const {
  std::vector<Duration> free;  // from now
  for (const auto& [batch, end] : ends_) free.push_back(std::max(Duration(0), end - now));
  while (static_cast<int>(free.size()) < workers_) free.emplace_back(0);
  std::sort(free.begin(), free.end());
  // Fills the workers up from the earliest on, as water does; `ahead` is what is left to pour.
  Duration level = free.front();
  for (size_t filled = 1; filled <= free.size(); ++filled) {
    const auto width = static_cast<int64_t>(filled);
    if (filled == free.size() || (free[filled] - level) * width >= ahead) return now + level + ahead / width;
    ahead -= (free[filled] - level) * width;
    level = free[filled];
  }
  return now + level;
}

}  // namespace stance
