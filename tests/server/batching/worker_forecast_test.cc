#include "server/batching/worker_forecast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/base/random.h"

namespace stance {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint kStart = TimePoint() + std::chrono::hours(1);

TEST(WorkerForecastTest, AFreeWorkerTakesTheNextAtOnce) {
  WorkerForecast forecast(2);
  forecast.Start(1, kStart + milliseconds(100));
  EXPECT_TRUE(forecast.has_free_worker());
  EXPECT_EQ(forecast.FreeAfter(kStart, Duration(0)), kStart);
  EXPECT_EQ(forecast.FreeAfter(kStart, milliseconds(60)), kStart + milliseconds(60));
  // The other one helps from 100 on.
  EXPECT_EQ(forecast.FreeAfter(kStart, milliseconds(160)), kStart + milliseconds(130));
}

TEST(WorkerForecastTest, WhatTakesLongerThanExpectedIsExpectedToEndAtOnce) {
  WorkerForecast forecast(1);
  forecast.Start(1, kStart + milliseconds(100));
  EXPECT_FALSE(forecast.has_free_worker());
  EXPECT_EQ(forecast.FreeAfter(kStart + milliseconds(500), Duration(0)), kStart + milliseconds(500));
  forecast.Finish(1);
  EXPECT_TRUE(forecast.has_free_worker());
}

// Against the definition, by bisection. Everything in steps of 12 ns, which 1 to 4 workers divide.
TEST(WorkerForecastTest, FreeAfterIsWhenTheWorkersHaveDoneWhatIsAhead) {
  for (uint64_t seed = 0; seed < 2000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const int workers = static_cast<int>(1 + random.Below(4));
    WorkerForecast forecast(workers);
    std::vector<int64_t> free(workers, 0);
    for (int w = 0; w < workers; ++w) {
      if (random.Chance(0.3)) continue;
      const int64_t end = 12 * (random.Below(200) - 20);
      forecast.Start(static_cast<uint64_t>(w), kStart + Duration(end));
      free[w] = std::max<int64_t>(0, end);
    }
    const int64_t ahead = 12 * random.Below(500);
    const auto done_by = [&](int64_t t) {
      int64_t done = 0;
      for (const int64_t f : free) done += std::max<int64_t>(0, t - f);
      return done;
    };
    int64_t low = *std::min_element(free.begin(), free.end()), high = 12 * 1000;
    while (low < high) {
      const int64_t middle = (low + high) / 2;
      if (done_by(middle) >= ahead) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    EXPECT_EQ(forecast.FreeAfter(kStart, Duration(ahead)) - kStart, Duration(low));
  }
}

}  // namespace
}  // namespace stance
