#include "server/access/token_bucket.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/random.h"

namespace stance {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr TimePoint kStart = TimePoint(std::chrono::hours(5));

struct Passed {
  TimePoint time;
  double units = 0;
};

// Random arrivals around a random rate, of units from a tenth to twice what passes in a second.
struct Arrivals {
  explicit Arrivals(uint64_t seed) : random(seed), rate(std::pow(10.0, random.Uniform(-2, 7))) {}
  void Next() {
    now += nanoseconds(random.Below(400'000'000));
    units = rate * random.Uniform(0.1, random.Chance(0.2) ? 2.0 : 0.5);
  }

  Random random;
  double rate;
  TimePoint now = kStart;
  double units = 0;
};

TEST(TokenBucketTest, NoWindowHoldsMoreThanItsRate) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    Arrivals arrivals(seed);
    TokenBucket bucket(arrivals.rate);
    std::vector<Passed> passed;
    for (int i = 0; i < 200; ++i) {
      arrivals.Next();
      if (bucket.WaitFor(arrivals.units, arrivals.now) > Duration::zero()) continue;
      bucket.Take(arrivals.units, arrivals.now);
      passed.push_back({arrivals.now, arrivals.units});
    }
    ASSERT_GT(passed.size(), 10u);
    for (size_t first = 0; first < passed.size(); ++first) {
      double sum = 0;
      for (size_t last = first; last < passed.size(); ++last) {
        sum += passed[last].units;
        const double time = ToSeconds(passed[last].time - passed[first].time);
        ASSERT_LE(sum,
                  arrivals.rate * time + std::max(arrivals.rate, passed[last].units) + arrivals.rate * 1e-6);
      }
    }
  }
}

TEST(TokenBucketTest, TheWaitIsExact) {
  int waits = 0;
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    Arrivals arrivals(seed);
    TokenBucket bucket(arrivals.rate);
    for (int i = 0; i < 200; ++i) {
      arrivals.Next();
      const Duration wait = bucket.WaitFor(arrivals.units, arrivals.now);
      if (wait > Duration::zero()) {
        ++waits;
        ASSERT_EQ(bucket.WaitFor(arrivals.units, arrivals.now + wait - nanoseconds(1)), nanoseconds(1));
        ASSERT_EQ(bucket.WaitFor(arrivals.units, arrivals.now + wait), Duration::zero());
        arrivals.now += wait;
      }
      bucket.Take(arrivals.units, arrivals.now);
    }
  }
  EXPECT_GT(waits, 1000);
}

TEST(TokenBucketTest, ASteadyCallerBelowTheRateIsNeverRefused) {
  TokenBucket bucket(7);
  for (int i = 0; i < 1000; ++i) {
    const TimePoint now = kStart + nanoseconds(142'857'143) * i;  // a seventh of a second, rounded up
    ASSERT_EQ(bucket.WaitFor(1, now), Duration::zero()) << i;
    bucket.Take(1, now);
  }
}

TEST(TokenBucketTest, AfterAPauseASecondsWorthPassesAtOnceAndNoMore) {
  TokenBucket bucket(5);
  for (const TimePoint now : {kStart, kStart + std::chrono::hours(100)}) {
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(bucket.WaitFor(1, now), Duration::zero()) << i;
      bucket.Take(1, now);
    }
    EXPECT_EQ(bucket.WaitFor(1, now), nanoseconds(200'000'000));
  }
}

TEST(TokenBucketTest, WhatIsLargerThanASecondsWorthPassesAndIsPaidOff) {
  TokenBucket bucket(100);
  EXPECT_EQ(bucket.WaitFor(1000, kStart), Duration::zero());
  bucket.Take(1000, kStart);
  EXPECT_EQ(bucket.WaitFor(100, kStart), seconds(10));
  EXPECT_EQ(bucket.WaitFor(1, kStart + seconds(9)), nanoseconds(10'000'000));
  EXPECT_EQ(bucket.WaitFor(1e30, kStart + seconds(10)), Duration::zero());
}

TEST(TokenBucketTest, HugeCostsAndAClockThatStandsStillAreHarmless) {
  TokenBucket bucket(1e-9);
  EXPECT_EQ(bucket.WaitFor(1e30, TimePoint::min()), Duration::zero());
  bucket.Take(1e30, kStart);
  EXPECT_GT(bucket.WaitFor(1, kStart), std::chrono::hours(24 * 365 * 30));
  EXPECT_GT(bucket.WaitFor(0, kStart - seconds(1)), Duration::zero());
}

}  // namespace
}  // namespace stance
