// How long a request will take, learned from how long others took.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>

#include "core/base/clock.h"

namespace stance {

// What a request took, seconds.
struct MeasuredCost {
  int64_t vertices = 0;
  double fixed = 0;    // in phases that take as long for every mesh, such as the networks
  double scaling = 0;  // in phases whose time grows with the vertices
};

// Estimates a + b * vertices for each kind of request, a and b being the medians of `fixed` and of `scaling`
// / `vertices` over the last kWindow measurements of that kind. Fewer than half of them, however wrong,
// cannot move either beyond what the others say, and a lasting change is believed after half a window. A kind
// of which fewer than kLeast have been measured is thought quick: what is refused is never measured.
//
// Needs no clock. Thread-safe.
class CostEstimator {
 public:
  static constexpr size_t kWindow = 15;
  static constexpr int64_t kLeast = 3;
  static constexpr double kPriorFixed = 1e-3;   // seconds
  static constexpr double kPriorVertex = 1e-6;  // seconds per vertex

  // Ignores what is no cost: not finite, negative, without vertices.
  void Learn(int kind, const MeasuredCost& cost);

  // At least 1 ns, at most an hour.
  Duration Estimate(int kind, int64_t vertices) const;

 private:
  struct Kind {
    std::array<double, kWindow> fixed{};
    std::array<double, kWindow> vertex{};  // scaling / vertices
    int64_t learned = 0;                   // the next one's place is learned % kWindow
    double fixed_median = kPriorFixed;
    double vertex_median = kPriorVertex;
  };

  mutable std::mutex mutex_;
  std::map<int, Kind> kinds_;  // protected by mutex_
};

}  // namespace stance
