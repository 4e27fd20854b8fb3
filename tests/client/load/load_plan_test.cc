#include "client/load/load_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <queue>
#include <vector>

namespace stance {
namespace {

struct Simulated {
  std::vector<double> planned, sent, answered;  // one entry per request, in the order of sending
  int64_t unsent = 0;
  int64_t most_in_flight = 0;
};

// Runs the plan against a server of one worker that needs `service` seconds per request, first come first
// served, in simulated time.
Simulated Simulate(const LoadPlanOptions& options, double service) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  LoadPlan plan(options);
  Simulated run;
  std::queue<double> answers;  // of the requests in flight, ascending
  double now = 0, worker_free = 0;
  for (;;) {
    const LoadStep step = plan.Next(now, static_cast<int64_t>(answers.size()));
    if (step.kind == LoadStep::Kind::kFinished) break;
    if (step.kind == LoadStep::Kind::kSend) {
      worker_free = std::max(worker_free, now) + service;
      run.planned.push_back(step.time);
      run.sent.push_back(now);
      run.answered.push_back(worker_free);
      answers.push(worker_free);
      run.most_in_flight = std::max(run.most_in_flight, static_cast<int64_t>(answers.size()));
      continue;
    }
    const double until = step.kind == LoadStep::Kind::kWaitUntil ? step.time : kNever;
    const double answer = answers.empty() ? kNever : answers.front();
    now = std::min(until, answer);
    EXPECT_LT(now, kNever) << "the plan waits for nothing";
    if (now == kNever) break;
    if (answer <= until) answers.pop();
  }
  run.unsent = plan.unsent();
  EXPECT_EQ(plan.sent(), static_cast<int64_t>(run.sent.size()));
  return run;
}

// Lindley's recursion for the waiting time in a queue with one worker: W' = max(0, W + S - A). It holds for
// latencies from the planned time even where the generator may only have one request in flight, which is what
// a generator that counts from the send time gets wrong.
TEST(LoadPlanTest, OpenLoopLatencyFollowsLindleysRecursionWhateverTheBoundInFlight) {
  constexpr double kService = 0.05;
  for (const int64_t bound : {1, 3, 1000}) {
    const Simulated run =
        Simulate({.rate = 18.0, .max_in_flight = bound, .requests = 2000, .seed = 4}, kService);
    ASSERT_EQ(run.sent.size(), 2000u);
    EXPECT_LE(run.most_in_flight, bound);
    double wait = 0;
    for (size_t i = 0; i < run.sent.size(); ++i) {
      if (i > 0) wait = std::max(0.0, wait + kService - (run.planned[i] - run.planned[i - 1]));
      ASSERT_NEAR(run.answered[i] - run.planned[i], wait + kService, 1e-9) << i << " bound " << bound;
    }
  }
}

TEST(LoadPlanTest, PlannedTimesDependOnRateAndSeedOnly) {
  const LoadPlanOptions options = {.rate = 50.0, .max_in_flight = 1000, .requests = 500, .seed = 9};
  const Simulated fast = Simulate(options, 0.0);
  LoadPlanOptions narrow = options;
  narrow.max_in_flight = 1;
  EXPECT_EQ(Simulate(narrow, 0.1).planned, fast.planned);
  LoadPlanOptions other = options;
  other.seed = 10;
  EXPECT_NE(Simulate(other, 0.0).planned, fast.planned);
}

TEST(LoadPlanTest, GapsAreExponential) {
  constexpr int kCount = 20000;
  const Simulated run = Simulate({.rate = 200.0, .max_in_flight = 10, .requests = kCount, .seed = 2}, 0.0);
  double sum = 0, squares = 0;
  int longer_than_mean = 0;
  for (int i = 1; i < kCount; ++i) {
    const double gap = (run.planned[i] - run.planned[i - 1]) * 200.0;
    EXPECT_GE(gap, 0.0);
    sum += gap, squares += gap * gap;
    longer_than_mean += gap > 1.0;
  }
  // Mean 1, second moment 2, P(gap > 1) = 1 / e; five standard errors.
  EXPECT_NEAR(sum / kCount, 1.0, 5 / std::sqrt(kCount));
  EXPECT_NEAR(squares / kCount, 2.0, 5 * std::sqrt(20.0 / kCount));
  EXPECT_NEAR(static_cast<double>(longer_than_mean) / kCount, std::exp(-1.0), 5 * 0.48 / std::sqrt(kCount));
}

TEST(LoadPlanTest, OpenLoopCountsWhatItCouldNotSend) {
  const LoadPlanOptions options = {.rate = 100.0, .max_in_flight = 2, .duration = 10.0, .seed = 5};
  LoadPlanOptions unbounded = options;
  unbounded.max_in_flight = 1000000;
  const Simulated all = Simulate(unbounded, 0.1);
  const Simulated bounded = Simulate(options, 0.1);
  EXPECT_EQ(all.unsent, 0);
  EXPECT_GT(bounded.unsent, 0);
  EXPECT_EQ(static_cast<int64_t>(bounded.sent.size()) + bounded.unsent,
            static_cast<int64_t>(all.sent.size()));
  for (const double time : bounded.sent) EXPECT_LT(time, 10.0);
  for (const double time : all.planned) EXPECT_LT(time, 10.0);
}

TEST(LoadPlanTest, UnsentRespectsTheLimitOnRequests) {
  const Simulated run =
      Simulate({.rate = 1000.0, .max_in_flight = 1, .duration = 1.0, .requests = 50, .seed = 5}, 0.3);
  EXPECT_EQ(static_cast<int64_t>(run.sent.size()) + run.unsent, 50);
}

TEST(LoadPlanTest, ClosedLoopKeepsEveryClientBusy) {
  const Simulated run = Simulate({.max_in_flight = 4, .requests = 100}, 0.01);
  ASSERT_EQ(run.sent.size(), 100u);
  EXPECT_EQ(run.most_in_flight, 4);
  EXPECT_EQ(run.planned, run.sent);
  EXPECT_EQ(run.unsent, 0);
  // One worker is always busy, and after the start each request waits for the three before it.
  EXPECT_NEAR(run.answered.back(), 100 * 0.01, 1e-9);
  for (size_t i = 4; i < 100; ++i) EXPECT_NEAR(run.answered[i] - run.sent[i], 4 * 0.01, 1e-9);
}

TEST(LoadPlanTest, ClosedLoopStopsAtTheDuration) {
  const Simulated run = Simulate({.max_in_flight = 1, .duration = 1.0}, 0.3);
  EXPECT_EQ(run.sent.size(), 4u);  // at 0, 0.3, 0.6 and 0.9
  EXPECT_EQ(run.unsent, 0);
}

}  // namespace
}  // namespace stance
