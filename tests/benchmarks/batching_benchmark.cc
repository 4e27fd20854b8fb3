// What the batching queue adds to a request, and how late it answers one that has expired.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <latch>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/random.h"
#include "server/batching/batch_runner.h"
#include "server/batching/cost_estimator.h"

namespace stance {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

// Long enough for a thread that has nothing to do to be asleep.
constexpr microseconds kRest(200);

// Quantiles as counters, in microseconds.
void Report(benchmark::State& state, std::vector<double>& seconds) {
  std::sort(seconds.begin(), seconds.end());
  const auto quantile = [&](double q) {
    const auto rank = static_cast<size_t>(q * static_cast<double>(seconds.size() - 1));
    return 1e6 * seconds[rank];
  };
  state.counters["p50_us"] = quantile(0.5);
  state.counters["p99_us"] = quantile(0.99);
  state.counters["max_us"] = 1e6 * seconds.back();
}

// What the machine takes to wake a sleeping thread through a condition variable: nobody can add less.
void HandOff(benchmark::State& state) {
  std::mutex mutex;
  std::condition_variable condition;
  bool stop = false, full = false;
  std::atomic<bool> taken = false;
  TimePoint taken_at;
  std::jthread worker([&] {
    std::unique_lock<std::mutex> lock(mutex);
    while (true) {
      condition.wait(lock, [&] { return full || stop; });
      if (stop) return;
      full = false;
      taken_at = RealClock().Now();
      taken = true;
    }
  });
  std::vector<double> seconds;
  for (auto _ : state) {
    std::this_thread::sleep_for(kRest);
    taken = false;
    const TimePoint start = RealClock().Now();
    {
      const std::lock_guard<std::mutex> guard(mutex);
      full = true;
    }
    condition.notify_one();
    while (!taken) std::this_thread::yield();
    seconds.push_back(ToSeconds(taken_at - start));
    state.SetIterationTime(seconds.back());
  }
  {
    const std::lock_guard<std::mutex> guard(mutex);
    stop = true;
  }
  condition.notify_one();
  Report(state, seconds);
}

// An idle runner: from Submit to the work's beginning, and from its end to the completion.
void IdleRunner(benchmark::State& state) {
  TimePoint began;
  BatchRunner<int> runner({.workers = 1}, [&](std::span<BatchItem<int>>) { began = RealClock().Now(); });
  std::vector<double> seconds;
  for (auto _ : state) {
    std::this_thread::sleep_for(kRest);
    std::atomic<bool> answered = false;
    TimePoint answered_at;
    BatchItem<int> item;
    item.client = "ipv4:127.0.0.1";
    item.done = Completion([&](Outcome) {
      answered_at = RealClock().Now();
      answered = true;
    });
    const TimePoint start = RealClock().Now();
    item.deadline = start + std::chrono::minutes(1);
    runner.Submit(std::move(item));
    while (!answered) std::this_thread::yield();
    seconds.push_back(ToSeconds(answered_at - start));
    state.SetIterationTime(seconds.back());
  }
  Report(state, seconds);
}

// One item in and one out of a queue that stays at `waiting` items of `clients` clients: the state machine
// alone.
void QueueStep(benchmark::State& state) {
  const int64_t waiting = state.range(0), clients = state.range(1);
  Batcher<int> batcher({.max_batch_items = 1, .max_queued_items = waiting + 1});
  Random random(1);
  const TimePoint now = RealClock().Now();
  const auto admit = [&] {
    BatchItem<int> item;
    item.client = std::to_string(random.Below(clients));
    item.priority = static_cast<Priority>(random.Below(3));
    item.work = microseconds(100 + random.Below(100));
    item.cost = 1 + random.Below(20'000);
    item.deadline = now + std::chrono::hours(1 + random.Below(100));
    item.done = Completion([](Outcome outcome) { benchmark::DoNotOptimize(outcome); });
    auto refused = batcher.Admit(std::move(item), now);
    if (refused) refused->item.done(refused->outcome);
  };
  for (int64_t i = 0; i < waiting; ++i) admit();
  for (auto _ : state) {
    admit();
    auto decision = batcher.Step(now, 1);
    batcher.Finish(decision.batch);
    for (auto& item : decision.dispatch) item.done(Outcome::kExecuted);
  }
  for (auto& refused : batcher.TakeAll(Outcome::kShuttingDown)) refused.item.done(refused.outcome);
}

// How long after its deadline a waiting item is answered while the only worker is busy.
void ExpiryLateness(benchmark::State& state) {
  std::latch busy(1), free(1);
  BatchRunner<int> runner({.workers = 1}, [&](std::span<BatchItem<int>>) {
    busy.count_down();
    free.wait();
  });
  BatchItem<int> blocker;
  blocker.done = Completion([](Outcome) {});
  runner.Submit(std::move(blocker));
  busy.wait();
  std::vector<double> seconds;
  for (auto _ : state) {
    std::atomic<bool> answered = false;
    TimePoint answered_at;
    BatchItem<int> item;
    item.deadline = RealClock().Now() + milliseconds(2);
    const TimePoint deadline = item.deadline;
    item.done = Completion([&](Outcome) {
      answered_at = RealClock().Now();
      answered = true;
    });
    runner.Submit(std::move(item));
    std::this_thread::sleep_until(deadline);
    while (!answered) std::this_thread::yield();
    seconds.push_back(ToSeconds(answered_at - deadline));
    state.SetIterationTime(std::max(1e-9, seconds.back()));
  }
  free.count_down();
  Report(state, seconds);
}

void Estimate(benchmark::State& state) {
  CostEstimator estimator;
  for (int i = 0; i < 15; ++i) estimator.Learn(0, {10'000, 0.05, 0.01});
  for (auto _ : state) benchmark::DoNotOptimize(estimator.Estimate(0, 10'000));
}

void Learn(benchmark::State& state) {
  CostEstimator estimator;
  double seconds = 0;
  for (auto _ : state) estimator.Learn(0, {10'000, 0.05, seconds += 1e-6});
}

BENCHMARK(HandOff)->UseManualTime();
BENCHMARK(IdleRunner)->UseManualTime();
BENCHMARK(ExpiryLateness)->UseManualTime();
BENCHMARK(QueueStep)
    ->ArgNames({"waiting", "clients"})
    ->Args({0, 1})
    ->Args({256, 1})
    ->Args({256, 16})
    ->Args({256, 256})
    ->Args({4096, 64});
BENCHMARK(Estimate);
BENCHMARK(Learn);

}  // namespace
}  // namespace stance

BENCHMARK_MAIN();
