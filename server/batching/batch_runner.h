// Runs a Batcher's decisions on worker threads.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <latch>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/clock.h"
#include "server/batching/batcher.h"

namespace stance {

// A fixed set of worker threads over one Batcher, and one more thread that answers items whose deadline
// passes while every worker is busy. No thread wakes while there is nothing to do.
//
// Every submitted item completes exactly once: on the caller's thread if it is refused, on a worker or the
// timer otherwise; never under the runner's mutex. Thread-safe.
template <typename Payload>
class BatchRunner {
 public:
  using Item = BatchItem<Payload>;
  // Does the work of a batch and leaves results in the payloads; must not throw. It may complete items itself
  // with kExecuted; those it leaves are completed so when it returns.
  using Work = std::function<void(std::span<Item>)>;

  struct Stats {
    int64_t queued_items = 0;
    int64_t queued_bytes = 0;
    int64_t queued_cost = 0;
    int64_t queued_clients = 0;  // that have something waiting
    int64_t running_items = 0;
  };

  // Starts `options.workers` threads, each of which calls `prepare` first, if there is one; returns when all
  // have. It must not throw. `clock` must outlive the runner.
  BatchRunner(const BatcherOptions& options, Work work, Clock& clock = RealClock(),
              const std::function<void()>& prepare = nullptr);
  // Shuts down at once: what waits is given back, what runs is finished.
  ~BatchRunner();

  BatchRunner(const BatchRunner&) = delete;
  BatchRunner& operator=(const BatchRunner&) = delete;

  // Queues the item, or completes it with the reason why not. Never waits for work.
  void Submit(Item item);

  // To be called after an item's cancel flag was set: completes it if it still waits.
  void SweepCancelled();

  // Refuses new items from now on and waits until every admitted one is complete, at most until `deadline`;
  // what still waits then is completed with kShuttingDown. True if nothing had to be given back.
  bool Drain(TimePoint deadline);

  Stats stats() const;

 private:
  using Refused = typename Batcher<Payload>::Refused;

  void WorkerLoop();
  void TimerLoop();
  // Makes the timer wake in time for the next expiry that no worker would notice.
  void ArmTimerLocked();
  // Lets the timer sleep on if nothing waits that could expire.
  void DisarmTimerLocked();
  static void Complete(std::vector<Refused>& refused);

  const Work work_;
  Clock& clock_;

  mutable std::mutex mutex_;
  std::condition_variable work_condition_;     // an item came, or stopping
  std::condition_variable timer_condition_;    // timer_at_ came nearer, or stopping
  std::condition_variable drained_condition_;  // nothing waits and nothing runs
  // Protected by mutex_:
  Batcher<Payload> batcher_;
  int idle_ = 0;         // workers that wait
  int64_t running_ = 0;  // items dispatched and not yet complete, or refused and being completed
  TimePoint timer_at_ = kNever;
  TimePoint next_expiry_ = kNever;  // of what waits; never later than the truth
  bool draining_ = false;
  bool stopping_ = false;

  std::vector<std::jthread> threads_;
};

template <typename Payload>
BatchRunner<Payload>::BatchRunner(const BatcherOptions& options, Work work, Clock& clock,
                                  const std::function<void()>& prepare)
    : work_(std::move(work)), clock_(clock), batcher_(options) {
  STANCE_CHECK(options.workers >= 1);
  std::latch prepared(options.workers);
  for (int i = 0; i < options.workers; ++i) {
    threads_.emplace_back([this, &prepare, &prepared] {
      if (prepare) prepare();
      prepared.count_down();
      WorkerLoop();
    });
  }
  prepared.wait();
  threads_.emplace_back([this] { TimerLoop(); });
}

template <typename Payload>
BatchRunner<Payload>::~BatchRunner() {
  Drain(clock_.Now());
  {
    std::lock_guard<std::mutex> guard(mutex_);
    stopping_ = true;
  }
  work_condition_.notify_all();
  timer_condition_.notify_all();
  threads_.clear();
}

template <typename Payload>
void BatchRunner<Payload>::Submit(Item item) {
  std::optional<Refused> refused;
  {
    std::lock_guard<std::mutex> guard(mutex_);
    if (draining_) {
      refused = Refused{std::move(item), Outcome::kShuttingDown};
    } else {
      const TimePoint deadline = item.deadline;
      refused = batcher_.Admit(std::move(item), clock_.Now());
      if (!refused) {
        next_expiry_ = std::min(next_expiry_, deadline);
        if (idle_ > 0) {
          work_condition_.notify_one();
        } else {
          ArmTimerLocked();
        }
      }
    }
  }
  if (refused) refused->item.done(refused->outcome, refused->retry_after);
}

template <typename Payload>
void BatchRunner<Payload>::SweepCancelled() {
  std::vector<Refused> refused;
  {
    std::lock_guard<std::mutex> guard(mutex_);
    refused = batcher_.TakeCancelled();
    running_ += static_cast<int64_t>(refused.size());
  }
  if (refused.empty()) return;
  Complete(refused);
  std::lock_guard<std::mutex> guard(mutex_);
  running_ -= static_cast<int64_t>(refused.size());
  if (running_ == 0 && batcher_.size() == 0) drained_condition_.notify_all();
}

template <typename Payload>
bool BatchRunner<Payload>::Drain(TimePoint deadline) {
  std::vector<Refused> refused;
  std::unique_lock<std::mutex> lock(mutex_);
  draining_ = true;
  while ((running_ > 0 || batcher_.size() > 0) && clock_.Now() < deadline) {
    clock_.WaitUntil(drained_condition_, lock, deadline);
  }
  refused = batcher_.TakeAll(Outcome::kShuttingDown);
  lock.unlock();
  Complete(refused);
  // What runs can't be stopped: the workers are waited for whatever the deadline says.
  lock.lock();
  while (running_ > 0) drained_condition_.wait(lock);
  return refused.empty();
}

template <typename Payload>
typename BatchRunner<Payload>::Stats BatchRunner<Payload>::stats() const {
  std::lock_guard<std::mutex> guard(mutex_);
  return {.queued_items = batcher_.size(),
          .queued_bytes = batcher_.bytes(),
          .queued_cost = batcher_.cost(),
          .queued_clients = batcher_.clients(),
          .running_items = running_};
}

template <typename Payload>
void BatchRunner<Payload>::WorkerLoop() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    ++idle_;
    auto decision = batcher_.Step(clock_.Now(), idle_);
    while (decision.dispatch.empty() && decision.refused.empty()) {
      if (stopping_) return;
      next_expiry_ = decision.wake_at;
      DisarmTimerLocked();
      clock_.WaitUntil(work_condition_, lock, kNever);
      decision = batcher_.Step(clock_.Now(), idle_);
    }
    --idle_;
    const int64_t taken = static_cast<int64_t>(decision.dispatch.size() + decision.refused.size());
    running_ += taken;
    next_expiry_ = decision.wake_at;
    ArmTimerLocked();
    lock.unlock();
    Complete(decision.refused);
    if (!decision.dispatch.empty()) work_(std::span<Item>(decision.dispatch));
    for (Item& item : decision.dispatch) {
      if (item.done.pending()) item.done(Outcome::kExecuted);
    }
    const uint64_t batch = decision.batch;
    decision = {};  // payloads are freed outside the lock
    lock.lock();
    batcher_.Finish(batch);
    running_ -= taken;
    if (running_ == 0 && batcher_.size() == 0) drained_condition_.notify_all();
  }
}

template <typename Payload>
void BatchRunner<Payload>::TimerLoop() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopping_) {
    const TimePoint now = clock_.Now();
    if (now < timer_at_) {
      clock_.WaitUntil(timer_condition_, lock, timer_at_);
      continue;
    }
    auto decision = batcher_.Step(now, 0);
    const int64_t taken = static_cast<int64_t>(decision.refused.size());
    running_ += taken;
    next_expiry_ = decision.wake_at;
    timer_at_ = kNever;
    ArmTimerLocked();
    lock.unlock();
    Complete(decision.refused);
    lock.lock();
    running_ -= taken;
    if (taken > 0 && running_ == 0 && batcher_.size() == 0) drained_condition_.notify_all();
  }
}

template <typename Payload>
void BatchRunner<Payload>::ArmTimerLocked() {
  // A free worker is awake or about to be, and takes or refuses what waits; the timer would only disturb.
  if (idle_ > 0 || next_expiry_ >= timer_at_) return;
  timer_at_ = next_expiry_;
  timer_condition_.notify_one();
}

template <typename Payload>
void BatchRunner<Payload>::DisarmTimerLocked() {
  if (timer_at_ == kNever || next_expiry_ != kNever) return;
  timer_at_ = kNever;
  timer_condition_.notify_one();
}

template <typename Payload>
void BatchRunner<Payload>::Complete(std::vector<Refused>& refused) {
  for (Refused& each : refused) each.item.done(each.outcome, each.retry_after);
}

}  // namespace stance
