#include "server/batching/cost_estimator.h"

#include <algorithm>
#include <cmath>

namespace stance {
namespace {

// An estimate beyond it says no more than "too long", and sums of such stay far from overflow.
constexpr double kMost = 3600;  // seconds

double Median(std::array<double, CostEstimator::kWindow> values, size_t count) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

}  // namespace

void CostEstimator::Learn(int kind, const MeasuredCost& cost) {
  const bool is_cost = std::isfinite(cost.fixed) && std::isfinite(cost.scaling) && cost.fixed >= 0 &&
                       cost.scaling >= 0 && cost.vertices > 0;
  if (!is_cost) return;
  const std::lock_guard<std::mutex> guard(mutex_);
  Kind& known = kinds_[kind];
  const size_t place = static_cast<size_t>(known.learned) % kWindow;
  known.fixed[place] = cost.fixed;
  known.vertex[place] = cost.scaling / static_cast<double>(cost.vertices);
  ++known.learned;
  if (known.learned < kLeast) return;
  const size_t count = std::min(static_cast<size_t>(known.learned), kWindow);
  known.fixed_median = Median(known.fixed, count);
  known.vertex_median = Median(known.vertex, count);
}

Duration CostEstimator::Estimate(int kind, int64_t vertices) const {
  double fixed = kPriorFixed, vertex = kPriorVertex;
  {
    const std::lock_guard<std::mutex> guard(mutex_);
    if (const auto it = kinds_.find(kind); it != kinds_.end()) {
      fixed = it->second.fixed_median;
      vertex = it->second.vertex_median;
    }
  }
  const double seconds =
      std::min(kMost, fixed + vertex * static_cast<double>(std::max<int64_t>(0, vertices)));
  const auto duration = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
  return std::max(duration, Duration(1));
}

}  // namespace stance
