// The batching queue as a pure state machine: no threads, no clock.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/clock.h"
#include "server/batching/completion.h"
#include "server/batching/fair_queue.h"
#include "server/batching/worker_forecast.h"

namespace stance {

struct BatcherOptions {
  // Batches that can run at the same time.
  int workers = 1;
  // Most items in one batch. Raise it where the work gains from company (a GPU); 1 turns batching off.
  int max_batch_items = 8;
  // Most cost (vertices) in one batch; an item that exceeds it alone runs alone. Bounds a batch's time and
  // memory.
  int64_t max_batch_cost = 200'000;
  // Most items waiting. More than workers can serve within the callers' deadlines only adds latency.
  int64_t max_queued_items = 256;
  // Most bytes waiting. Bounds the memory held for callers whose turn has not come.
  int64_t max_queued_bytes = int64_t{1} << 30;
  // Most cost waiting; an item that exceeds it alone waits alone. Bounds how long a full queue lasts.
  int64_t max_queued_cost = 10'000'000;
  // Most items of one client waiting; 0: no such bound. Keeps room in the queue for the others.
  int64_t max_queued_items_per_client = 0;
  // A step of priority counts as so much waiting. 0: priorities are ignored.
  Duration priority_aging = std::chrono::seconds(5);
  // Whether to refuse at once what is expected to miss its deadline.
  bool refuse_unmeetable = true;
};

// A piece of work and what the queue must know about it.
template <typename Payload>
struct BatchItem {
  int64_t cost = 1;   // share of a batch, e.g. vertices
  int64_t bytes = 0;  // memory held while it waits
  int bucket = 0;     // only items of one bucket share a batch
  std::string client{};
  Priority priority = Priority::kNormal;
  Duration work{1};  // how long it is expected to run, at least 1 ns
  TimePoint deadline = kNever;
  // Set by the caller to give the item up; read at dispatch and by the work itself. May be null.
  std::shared_ptr<const std::atomic<bool>> cancelled{};
  Payload payload{};
  Completion done{};
  TimePoint admitted{};  // set by the batcher

  bool is_cancelled() const { return cancelled != nullptr && cancelled->load(); }
};

// Waiting items, in FairQueue's order.
//
// A batch is formed only when a worker is free: the item whose turn it is and those of its bucket that fit
// with it. Where several workers are free, each takes its share of the queue.
// Invariants: (1) size() <= max_queued_items, bytes() <= max_queued_bytes, and cost() <= max_queued_cost
// unless size() is 1; (2) every admitted item leaves exactly once, dispatched or refused; (3) none is
// dispatched at or after its deadline, or once its flag is set; (4) a batch has one bucket, at most
// max_batch_items, and at most max_batch_cost unless it is one item; (5) FairQueue's: none starves.
// Not thread-safe.
template <typename Payload>
class Batcher {
 public:
  using Item = BatchItem<Payload>;

  struct Refused {
    Item item;
    Outcome outcome;
    Duration retry_after{};  // as Completion's
  };

  // What to do now.
  struct Decision {
    std::vector<Item> dispatch;    // one batch for one free worker; empty if there is no work or no worker
    uint64_t batch = 0;            // its number, for Finish
    std::vector<Refused> refused;  // expired or cancelled; each is to be completed
    TimePoint wake_at = kNever;    // when an item that still waits will expire
  };

  explicit Batcher(const BatcherOptions& options)
      : options_(options), order_(options.priority_aging), forecast_(options.workers) {}

  // Takes the item into the queue and returns nothing, or returns it with the reason why not.
  std::optional<Refused> Admit(Item item, TimePoint now);

  // The next step, given the time and how many workers are free.
  Decision Step(TimePoint now, int idle_workers);

  // To be called when a dispatched batch has run.
  void Finish(uint64_t batch) { forecast_.Finish(batch); }

  // Takes out every item whose cancel flag is set. Linear in size(): for the rare cancellation.
  std::vector<Refused> TakeCancelled();

  // Takes out everything that waits.
  std::vector<Refused> TakeAll(Outcome outcome);

  int64_t size() const { return static_cast<int64_t>(items_.size()); }
  int64_t bytes() const { return bytes_; }
  int64_t cost() const { return cost_; }
  int64_t clients() const { return order_.clients(); }

 private:
  using Items = std::map<uint64_t, Item>;  // key: order of arrival

  // Of what would be refused while a worker is free, every so many-th runs all the same: the expectation may
  // be wrong, and only running shows it.
  static constexpr int kProbe = 8;

  std::optional<Outcome> NoRoomFor(const Item& item) const;
  // Whether the item is expected to miss its deadline, and what to say then.
  std::optional<std::pair<Outcome, Duration>> Unmeetable(const Item& item, TimePoint now);
  // Moves the item out of the queue, if FairQueue has let it go.
  Item Take(uint64_t id);
  Refused Refuse(uint64_t id, Outcome outcome);
  void TakeExpired(TimePoint now, std::vector<Refused>& out);

  const BatcherOptions options_;
  Items items_;
  FairQueue order_;                                     // of items_
  WorkerForecast forecast_;                             // of dispatched batches
  std::set<std::pair<TimePoint, uint64_t>> deadlines_;  // of items_ that have one
  uint64_t next_id_ = 0;
  uint64_t next_batch_ = 1;
  int64_t bytes_ = 0;  // sum over items_, as is cost_
  int64_t cost_ = 0;
  int refused_while_free_ = 0;  // in a row
};

template <typename Payload>
std::optional<Outcome> Batcher<Payload>::NoRoomFor(const Item& item) const {
  if (size() >= options_.max_queued_items) return Outcome::kQueueFull;
  if (item.bytes > options_.max_queued_bytes - bytes_) return Outcome::kQueueBytes;
  if (size() > 0 && item.cost > options_.max_queued_cost - cost_) return Outcome::kQueueCost;
  const int64_t quota = options_.max_queued_items_per_client;
  if (quota > 0 && order_.CountOf(item.client) >= quota) return Outcome::kClientQuota;
  return std::nullopt;
}

template <typename Payload>
std::optional<std::pair<Outcome, Duration>> Batcher<Payload>::Unmeetable(const Item& item, TimePoint now) {
  if (!options_.refuse_unmeetable || item.deadline == kNever) return std::nullopt;
  const Duration ahead = order_.WorkBefore(item.client, item.priority, item.work);
  const TimePoint end = forecast_.FreeAfter(now, ahead) + item.work;
  if (end <= item.deadline) return std::nullopt;
  if (now + item.work <= item.deadline) return std::pair(Outcome::kTooMuchAhead, end - item.deadline);
  if (size() == 0 && forecast_.has_free_worker() && ++refused_while_free_ == kProbe) {
    refused_while_free_ = 0;
    return std::nullopt;
  }
  return std::pair(Outcome::kDeadlineShort, Duration(0));
}

template <typename Payload>
std::optional<typename Batcher<Payload>::Refused> Batcher<Payload>::Admit(Item item, TimePoint now) {
  if (item.is_cancelled()) return Refused{std::move(item), Outcome::kCancelled};
  if (item.deadline <= now) return Refused{std::move(item), Outcome::kExpired};
  if (const auto outcome = NoRoomFor(item)) return Refused{std::move(item), *outcome};
  if (const auto unmeetable = Unmeetable(item, now)) {
    return Refused{std::move(item), unmeetable->first, unmeetable->second};
  }
  const uint64_t id = next_id_++;
  item.admitted = now;
  bytes_ += item.bytes;
  cost_ += item.cost;
  if (item.deadline != kNever) deadlines_.emplace(item.deadline, id);
  order_.Add({id, item.client, item.priority, now, item.work, item.cost, item.bucket});
  items_.emplace_hint(items_.end(), id, std::move(item));
  return std::nullopt;
}

template <typename Payload>
typename Batcher<Payload>::Decision Batcher<Payload>::Step(TimePoint now, int idle_workers) {
  Decision decision;
  TakeExpired(now, decision.refused);
  if (idle_workers > 0) {
    const int64_t share = (size() + idle_workers - 1) / idle_workers;
    const auto most = static_cast<size_t>(std::min<int64_t>(share, options_.max_batch_items));
    int64_t cost = 0;
    Duration work{};
    while (decision.dispatch.size() < most) {
      const auto id = decision.dispatch.empty() ? order_.Next()
                                                : order_.Companion(decision.dispatch.front().bucket,
                                                                   options_.max_batch_cost - cost);
      if (!id) break;
      if (items_.at(*id).is_cancelled()) {
        decision.refused.push_back(Refuse(*id, Outcome::kCancelled));
        continue;
      }
      order_.Serve(*id);
      decision.dispatch.push_back(Take(*id));
      cost += decision.dispatch.back().cost;
      work += decision.dispatch.back().work;
    }
    if (!decision.dispatch.empty()) {
      decision.batch = next_batch_++;
      forecast_.Start(decision.batch, now + work);
    }
  }
  if (!deadlines_.empty()) decision.wake_at = deadlines_.begin()->first;
  return decision;
}

template <typename Payload>
std::vector<typename Batcher<Payload>::Refused> Batcher<Payload>::TakeCancelled() {
  std::vector<uint64_t> ids;
  for (const auto& [id, item] : items_) {
    if (item.is_cancelled()) ids.push_back(id);
  }
  std::vector<Refused> out;
  for (const uint64_t id : ids) out.push_back(Refuse(id, Outcome::kCancelled));
  return out;
}

template <typename Payload>
std::vector<typename Batcher<Payload>::Refused> Batcher<Payload>::TakeAll(Outcome outcome) {
  std::vector<Refused> out;
  while (!items_.empty()) out.push_back(Refuse(items_.begin()->first, outcome));
  return out;
}

template <typename Payload>
typename Batcher<Payload>::Item Batcher<Payload>::Take(uint64_t id) {
  const auto it = items_.find(id);
  bytes_ -= it->second.bytes;
  cost_ -= it->second.cost;
  deadlines_.erase({it->second.deadline, id});
  Item item = std::move(it->second);
  items_.erase(it);
  return item;
}

template <typename Payload>
typename Batcher<Payload>::Refused Batcher<Payload>::Refuse(uint64_t id, Outcome outcome) {
  order_.Drop(id);
  return {Take(id), outcome};
}

template <typename Payload>
void Batcher<Payload>::TakeExpired(TimePoint now, std::vector<Refused>& out) {
  while (!deadlines_.empty() && deadlines_.begin()->first <= now) {
    out.push_back(Refuse(deadlines_.begin()->second, Outcome::kExpired));
  }
}

}  // namespace stance
