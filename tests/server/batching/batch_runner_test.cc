#include "server/batching/batch_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <latch>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "core/base/random.h"
#include "tests/support/fake_clock.h"

namespace stance {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;

using TestRunner = BatchRunner<int>;
using TestItem = TestRunner::Item;

// An item whose outcome can be waited for.
struct Submission {
  TestItem item;
  std::future<Outcome> outcome;
};

Submission Make(int number, TimePoint deadline = kNever,
                std::shared_ptr<const std::atomic<bool>> cancelled = nullptr) {
  auto promise = std::make_shared<std::promise<Outcome>>();
  Submission submission;
  submission.outcome = promise->get_future();
  submission.item.payload = number;
  submission.item.deadline = deadline;
  submission.item.cancelled = std::move(cancelled);
  submission.item.done = Completion([promise](Outcome outcome) { promise->set_value(outcome); });
  return submission;
}

// Work that waits at a gate, so that a test decides how long a worker is busy.
class GatedWork {
 public:
  TestRunner::Work AsWork() {
    return [this](std::span<TestItem> batch) {
      std::unique_lock<std::mutex> lock(mutex_);
      std::vector<int> numbers;
      for (const TestItem& item : batch) numbers.push_back(item.payload);
      batches_.push_back(numbers);
      changed_.notify_all();
      changed_.wait(lock, [this] { return open_; });
    };
  }
  void AwaitBatches(size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return batches_.size() >= count; });
  }
  void Open() {
    std::lock_guard<std::mutex> guard(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  std::vector<std::vector<int>> batches() {
    std::lock_guard<std::mutex> guard(mutex_);
    return batches_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::vector<int>> batches_;
  bool open_ = false;
};

// The real clock, that tells who sleeps and until when at most.
class WatchedClock : public Clock {
 public:
  TimePoint Now() override { return RealClock().Now(); }
  void WaitUntil(std::condition_variable& condition, std::unique_lock<std::mutex>& lock,
                 TimePoint when) override {
    {
      const std::lock_guard<std::mutex> guard(mutex_);
      limits_[std::this_thread::get_id()] = when;
    }
    RealClock().WaitUntil(condition, lock, when);
    const std::lock_guard<std::mutex> guard(mutex_);
    limits_.erase(std::this_thread::get_id());
  }
  // How many sleep, and how many of them without a limit.
  std::pair<size_t, size_t> Sleepers() {
    const std::lock_guard<std::mutex> guard(mutex_);
    const auto endless =
        std::count_if(limits_.begin(), limits_.end(), [](const auto& each) { return each.second == kNever; });
    return {limits_.size(), static_cast<size_t>(endless)};
  }
  // Until so many sleep without a limit; false if that takes longer than any machine needs.
  bool AwaitEndlessSleepers(size_t count) {
    const TimePoint patience = Now() + std::chrono::minutes(1);
    while (Sleepers().second != count) {
      if (Now() > patience) return false;
      std::this_thread::yield();
    }
    return true;
  }

 private:
  std::mutex mutex_;
  std::map<std::thread::id, TimePoint> limits_;  // protected by mutex_
};

TEST(BatchRunnerTest, ExecutesWhatIsSubmitted) {
  std::atomic<int> sum = 0;
  TestRunner runner({.workers = 2}, [&sum](std::span<TestItem> batch) {
    for (const TestItem& item : batch) sum += item.payload;
  });
  std::vector<std::future<Outcome>> outcomes;
  for (int i = 1; i <= 100; ++i) {
    Submission submission = Make(i);
    runner.Submit(std::move(submission.item));
    outcomes.push_back(std::move(submission.outcome));
  }
  for (auto& outcome : outcomes) EXPECT_EQ(outcome.get(), Outcome::kExecuted);
  EXPECT_EQ(sum, 5050);
}

TEST(BatchRunnerTest, EveryWorkerIsPreparedBeforeItIsConstructed) {
  std::mutex mutex;
  std::set<std::thread::id> prepared;
  BatchRunner<int> runner(
      {.workers = 3}, [](std::span<BatchItem<int>>) {}, RealClock(),
      [&] {
        const std::lock_guard<std::mutex> guard(mutex);
        prepared.insert(std::this_thread::get_id());
      });
  EXPECT_EQ(prepared.size(), 3u);
  EXPECT_FALSE(prepared.contains(std::this_thread::get_id()));
}

TEST(BatchRunnerTest, WhatArrivesWhileTheWorkerIsBusySharesTheNextBatch) {
  GatedWork work;
  TestRunner runner({.workers = 1}, work.AsWork());
  Submission first = Make(0);
  runner.Submit(std::move(first.item));
  work.AwaitBatches(1);
  std::vector<Submission> later;
  for (int i = 1; i <= 3; ++i) {
    later.push_back(Make(i));
    runner.Submit(std::move(later.back().item));
  }
  EXPECT_EQ(runner.stats().queued_items, 3);
  EXPECT_EQ(runner.stats().running_items, 1);
  work.Open();
  for (auto& each : later) EXPECT_EQ(each.outcome.get(), Outcome::kExecuted);
  EXPECT_THAT(work.batches(), ElementsAre(ElementsAre(0), ElementsAre(1, 2, 3)));
}

TEST(BatchRunnerTest, RefusesOnTheCallersThreadWhenTheQueueIsFull) {
  GatedWork work;
  TestRunner runner({.workers = 1, .max_queued_items = 1}, work.AsWork());
  Submission running = Make(0), waiting = Make(1), refused = Make(2);
  runner.Submit(std::move(running.item));
  work.AwaitBatches(1);
  runner.Submit(std::move(waiting.item));
  runner.Submit(std::move(refused.item));
  ASSERT_EQ(refused.outcome.wait_for(seconds(0)), std::future_status::ready);
  EXPECT_EQ(refused.outcome.get(), Outcome::kQueueFull);
  work.Open();
  EXPECT_EQ(waiting.outcome.get(), Outcome::kExecuted);
}

TEST(BatchRunnerTest, AnExpiredItemIsAnsweredWhileTheWorkerIsBusy) {
  testing::FakeClock clock;
  GatedWork work;
  TestRunner runner({.workers = 1}, work.AsWork(), clock);
  Submission running = Make(0), doomed = Make(1, clock.Now() + milliseconds(10)), patient = Make(2);
  runner.Submit(std::move(running.item));
  work.AwaitBatches(1);
  runner.Submit(std::move(doomed.item));
  runner.Submit(std::move(patient.item));
  clock.Advance(milliseconds(10));
  EXPECT_EQ(doomed.outcome.get(), Outcome::kExpired);
  EXPECT_EQ(running.outcome.wait_for(seconds(0)), std::future_status::timeout);
  work.Open();
  EXPECT_EQ(patient.outcome.get(), Outcome::kExecuted);
  EXPECT_THAT(work.batches(), ElementsAre(ElementsAre(0), ElementsAre(2)));
}

TEST(BatchRunnerTest, ANearerDeadlineMovesTheTimerForward) {
  testing::FakeClock clock;
  GatedWork work;
  TestRunner runner({.workers = 1}, work.AsWork(), clock);
  Submission running = Make(0);
  Submission later = Make(1, clock.Now() + milliseconds(30));
  Submission sooner = Make(2, clock.Now() + milliseconds(10));
  runner.Submit(std::move(running.item));
  work.AwaitBatches(1);
  runner.Submit(std::move(later.item));
  runner.Submit(std::move(sooner.item));
  clock.Advance(milliseconds(10));
  EXPECT_EQ(sooner.outcome.get(), Outcome::kExpired);
  EXPECT_EQ(later.outcome.wait_for(seconds(0)), std::future_status::timeout);
  clock.Advance(milliseconds(20));
  EXPECT_EQ(later.outcome.get(), Outcome::kExpired);
  work.Open();
}

TEST(BatchRunnerTest, ACancelledItemIsAnsweredWhileTheWorkerIsBusy) {
  GatedWork work;
  TestRunner runner({.workers = 1}, work.AsWork());
  auto flag = std::make_shared<std::atomic<bool>>(false);
  Submission running = Make(0), cancelled = Make(1, kNever, flag);
  runner.Submit(std::move(running.item));
  work.AwaitBatches(1);
  runner.Submit(std::move(cancelled.item));
  flag->store(true);
  runner.SweepCancelled();
  ASSERT_EQ(cancelled.outcome.wait_for(seconds(0)), std::future_status::ready);
  EXPECT_EQ(cancelled.outcome.get(), Outcome::kCancelled);
  work.Open();
  EXPECT_EQ(running.outcome.get(), Outcome::kExecuted);
}

TEST(BatchRunnerTest, DrainFinishesEverythingAdmittedAndRefusesTheRest) {
  GatedWork work;
  TestRunner runner({.workers = 1}, work.AsWork());
  Submission running = Make(0), waiting = Make(1), late = Make(2);
  runner.Submit(std::move(running.item));
  work.AwaitBatches(1);
  runner.Submit(std::move(waiting.item));
  auto drained = std::async(std::launch::async, [&runner] { return runner.Drain(kNever); });
  // Drain is under way once new items are refused for it.
  while (true) {
    Submission probe = Make(3);
    runner.Submit(std::move(probe.item));
    if (probe.outcome.wait_for(seconds(0)) == std::future_status::ready) {
      // The probes themselves may have filled the queue by then.
      const Outcome outcome = probe.outcome.get();
      if (outcome == Outcome::kShuttingDown) break;
      ASSERT_EQ(outcome, Outcome::kQueueFull);
    }
    std::this_thread::yield();
  }
  work.Open();
  EXPECT_TRUE(drained.get());
  EXPECT_EQ(running.outcome.get(), Outcome::kExecuted);
  EXPECT_EQ(waiting.outcome.get(), Outcome::kExecuted);
  runner.Submit(std::move(late.item));
  EXPECT_EQ(late.outcome.get(), Outcome::kShuttingDown);
}

TEST(BatchRunnerTest, DrainGivesBackWhatStillWaitsAtItsDeadline) {
  testing::FakeClock clock;
  GatedWork work;
  TestRunner runner({.workers = 1}, work.AsWork(), clock);
  Submission running = Make(0), waiting = Make(1);
  runner.Submit(std::move(running.item));
  work.AwaitBatches(1);
  runner.Submit(std::move(waiting.item));
  auto drained = std::async(std::launch::async, [&] { return runner.Drain(clock.Now()); });
  EXPECT_EQ(waiting.outcome.get(), Outcome::kShuttingDown);
  work.Open();
  EXPECT_FALSE(drained.get());
  EXPECT_EQ(running.outcome.get(), Outcome::kExecuted);
}

// Two workers and the timer: whatever has been before, they sleep without a limit when there is nothing to
// do, so that nothing but a request can wake them.
TEST(BatchRunnerTest, NothingWakesWhenIdle) {
  WatchedClock clock;
  GatedWork work;
  TestRunner runner({.workers = 2, .max_batch_items = 1}, work.AsWork(), clock);
  EXPECT_TRUE(clock.AwaitEndlessSleepers(3));
  std::vector<Submission> submissions;
  for (int i = 0; i < 2; ++i) {
    submissions.push_back(Make(i));
    runner.Submit(std::move(submissions.back().item));
  }
  work.AwaitBatches(2);
  for (int i = 2; i < 10; ++i) {
    submissions.push_back(Make(i, clock.Now() + std::chrono::hours(1)));
    runner.Submit(std::move(submissions.back().item));
  }
  // The timer waits for the nearest deadline, which no worker would notice.
  while (clock.Sleepers() != std::pair<size_t, size_t>(1, 0)) std::this_thread::yield();
  work.Open();
  for (Submission& each : submissions) EXPECT_EQ(each.outcome.get(), Outcome::kExecuted);
  EXPECT_TRUE(clock.AwaitEndlessSleepers(3));
}

// On the real clock: while every worker is busy, each is answered when its own deadline has passed.
TEST(BatchRunnerTest, ExpiredItemsAreAnsweredInTheOrderOfTheirDeadlines) {
  constexpr int kItems = 8;
  GatedWork work;
  TestRunner runner({.workers = 2, .max_batch_items = 1}, work.AsWork());
  Submission running[] = {Make(100), Make(101)};
  for (Submission& each : running) runner.Submit(std::move(each.item));
  work.AwaitBatches(2);
  std::mutex mutex;
  std::vector<int> answered;
  std::vector<TimePoint> answered_at(kItems), deadlines(kItems);
  std::latch all(kItems);
  const TimePoint start = RealClock().Now();
  for (int i = 0; i < kItems; ++i) {
    const int rank = (5 * i) % kItems;  // arrives as the i-th, expires as the rank-th
    TestItem item;
    item.payload = rank;
    item.deadline = deadlines[rank] = start + milliseconds(300 + 5 * rank);
    item.done = Completion([&, rank](Outcome outcome) {
      EXPECT_EQ(outcome, Outcome::kExpired);
      {
        const std::lock_guard<std::mutex> guard(mutex);
        answered.push_back(rank);
        answered_at[rank] = RealClock().Now();
      }
      all.count_down();
    });
    runner.Submit(std::move(item));
  }
  // Where the machine stalls for longer than that, some expire before they are submitted.
  const bool all_waited = RealClock().Now() < deadlines[0];
  all.wait();
  if (all_waited) {
    EXPECT_THAT(answered, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  }
  for (int rank = 0; rank < kItems; ++rank) EXPECT_GE(answered_at[rank], deadlines[rank]);
  for (Submission& each : running) EXPECT_EQ(each.outcome.wait_for(seconds(0)), std::future_status::timeout);
  work.Open();
  for (Submission& each : running) EXPECT_EQ(each.outcome.get(), Outcome::kExecuted);
  EXPECT_EQ(work.batches().size(), 2u) << "an expired item ran";
}

TEST(BatchRunnerTest, RefusesOnTheCallersThreadWhatCannotMeetItsDeadline) {
  testing::FakeClock clock;
  GatedWork work;
  TestRunner runner({.workers = 1}, work.AsWork(), clock);
  Submission running = Make(0);
  running.item.work = seconds(10);
  runner.Submit(std::move(running.item));
  work.AwaitBatches(1);
  TestItem late;
  late.work = milliseconds(1);
  late.deadline = clock.Now() + seconds(4);
  std::optional<std::pair<Outcome, Duration>> answer;
  late.done =
      Completion([&](Outcome outcome, Duration retry_after) { answer = std::pair(outcome, retry_after); });
  runner.Submit(std::move(late));
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->first, Outcome::kTooMuchAhead);
  EXPECT_EQ(answer->second, milliseconds(6'001));
  Submission in_time = Make(1, clock.Now() + seconds(11));
  in_time.item.work = milliseconds(1);
  runner.Submit(std::move(in_time.item));
  work.Open();
  EXPECT_EQ(in_time.outcome.get(), Outcome::kExecuted);
  EXPECT_EQ(running.outcome.get(), Outcome::kExecuted);
  // What was expected of a finished batch is forgotten.
  while (runner.stats().running_items > 0) std::this_thread::yield();
  Submission next = Make(2, clock.Now() + seconds(4));
  next.item.work = milliseconds(1);
  runner.Submit(std::move(next.item));
  EXPECT_EQ(next.outcome.get(), Outcome::kExecuted);
}

// Idle workers and an idle timer sleep without a limit: the clock can jump by hours and nobody goes back to
// sleep more than once for it.
TEST(BatchRunnerTest, ServesAfterALongIdleTime) {
  testing::FakeClock clock;
  TestRunner runner(
      {.workers = 2}, [](std::span<TestItem>) {}, clock);
  clock.Advance(std::chrono::hours(5));
  Submission submission = Make(0, clock.Now() + milliseconds(1));
  runner.Submit(std::move(submission.item));
  EXPECT_EQ(submission.outcome.get(), Outcome::kExecuted);
}

TEST(BatchRunnerTest, WorkMayCompleteItemsItself) {
  TestRunner runner({.workers = 1}, [](std::span<TestItem> batch) {
    for (TestItem& item : batch) item.done(Outcome::kExecuted);
  });
  Submission submission = Make(0);
  runner.Submit(std::move(submission.item));
  EXPECT_EQ(submission.outcome.get(), Outcome::kExecuted);
}

// Many threads submit, cancel and let deadlines pass; each item completes exactly once (Completion aborts on
// a second or a missing call) and none runs after its deadline by more than the dispatch itself.
TEST(BatchRunnerTest, SurvivesContention) {
  constexpr int kThreads = 4, kItems = 2000;
  std::atomic<int> executed = 0, completed = 0, ran = 0;
  {
    TestRunner runner({.workers = 3, .max_batch_items = 4, .max_queued_items = 4096},
                      [&ran](std::span<TestItem> batch) {
                        ran += static_cast<int>(batch.size());
                        std::this_thread::yield();
                      });
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&, t] {
        Random random(7, t);
        for (int i = 0; i < kItems; ++i) {
          TestItem item;
          item.payload = i;
          item.bucket = static_cast<int>(random.Below(2));
          item.client = std::to_string(random.Below(5));
          item.priority = static_cast<Priority>(random.Below(3));
          item.work = std::chrono::microseconds(1 + random.Below(3));
          if (random.Chance(0.5)) {
            item.deadline = RealClock().Now() + std::chrono::microseconds(random.Below(300));
          }
          auto flag = std::make_shared<std::atomic<bool>>(false);
          item.cancelled = flag;
          item.done = Completion([&](Outcome outcome) {
            ++completed;
            if (outcome == Outcome::kExecuted) ++executed;
          });
          runner.Submit(std::move(item));
          if (random.Chance(0.2)) {
            flag->store(true);
            runner.SweepCancelled();
          }
        }
      });
    }
    threads.clear();
    EXPECT_TRUE(runner.Drain(kNever));
    EXPECT_EQ(completed, kThreads * kItems);
  }
  EXPECT_EQ(executed, ran);
  EXPECT_GT(executed, 0);
}

}  // namespace
}  // namespace stance
