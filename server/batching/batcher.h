// The batching queue as a pure state machine: no threads, no clock.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/base/clock.h"
#include "server/batching/completion.h"

namespace stance {

struct BatcherOptions {
  // Most items in one batch. Raise it where the work gains from company (a GPU); 1 turns batching off.
  int max_batch_items = 8;
  // Most cost (vertices) in one batch; an item that exceeds it alone runs alone. Bounds a batch's time and
  // memory.
  int64_t max_batch_cost = 200'000;
  // Most items waiting. More than workers can serve within the callers' deadlines only adds latency.
  int64_t max_queued_items = 256;
  // Most bytes waiting. Bounds the memory held for callers whose turn has not come.
  int64_t max_queued_bytes = int64_t{1} << 30;
};

// A piece of work and what the queue must know about it.
template <typename Payload>
struct BatchItem {
  int64_t cost = 1;   // share of a batch, e.g. vertices
  int64_t bytes = 0;  // memory held while it waits
  int bucket = 0;     // only items of one bucket share a batch
  TimePoint deadline = kNever;
  // Set by the caller to give the item up; read at dispatch and by the work itself. May be null.
  std::shared_ptr<const std::atomic<bool>> cancelled;
  Payload payload{};
  Completion done;
  TimePoint admitted{};  // set by the batcher

  bool is_cancelled() const { return cancelled != nullptr && cancelled->load(); }
};

// Waiting items in the order of their arrival.
//
// A batch is formed only when a worker is free: the oldest item and those of its bucket that fit with it, so
// none starves. Where several workers are free, each takes its share of the queue.
// Invariants: (1) size() <= max_queued_items and bytes() <= max_queued_bytes; (2) every admitted item leaves
// exactly once, dispatched or refused; (3) none is dispatched at or after its deadline, or once its flag is
// set; (4) a batch has one bucket, at most max_batch_items, and at most max_batch_cost unless it is one item.
// Not thread-safe.
template <typename Payload>
class Batcher {
 public:
  using Item = BatchItem<Payload>;

  struct Refused {
    Item item;
    Outcome outcome;
  };

  // What to do now.
  struct Decision {
    std::vector<Item> dispatch;    // one batch for one free worker; empty if there is no work or no worker
    std::vector<Refused> refused;  // expired or cancelled; each is to be completed
    TimePoint wake_at = kNever;    // when an item that still waits will expire
  };

  explicit Batcher(const BatcherOptions& options) : options_(options) {}

  // Takes the item into the queue and returns nothing, or returns it with the reason why not.
  std::optional<Refused> Admit(Item item, TimePoint now);

  // The next step, given the time and how many workers are free.
  Decision Step(TimePoint now, int idle_workers);

  // Takes out every item whose cancel flag is set. Linear in size(): for the rare cancellation.
  std::vector<Refused> TakeCancelled();

  // Takes out everything that waits.
  std::vector<Refused> TakeAll(Outcome outcome);

  int64_t size() const { return static_cast<int64_t>(queue_.size()); }
  int64_t bytes() const { return bytes_; }

 private:
  using Queue = std::map<uint64_t, Item>;  // key: order of arrival

  typename Queue::iterator Take(typename Queue::iterator it, Item& out);
  void TakeExpired(TimePoint now, std::vector<Refused>& out);

  const BatcherOptions options_;
  Queue queue_;
  std::set<std::pair<TimePoint, uint64_t>> deadlines_;  // of queue_'s items that have one
  uint64_t next_order_ = 0;
  int64_t bytes_ = 0;  // sum over queue_
};

template <typename Payload>
std::optional<typename Batcher<Payload>::Refused> Batcher<Payload>::Admit(Item item, TimePoint now) {
  if (item.is_cancelled()) return Refused{std::move(item), Outcome::kCancelled};
  if (item.deadline <= now) return Refused{std::move(item), Outcome::kExpired};
  if (size() >= options_.max_queued_items) return Refused{std::move(item), Outcome::kQueueFull};
  if (item.bytes > options_.max_queued_bytes - bytes_) return Refused{std::move(item), Outcome::kQueueBytes};
  const uint64_t order = next_order_++;
  item.admitted = now;
  bytes_ += item.bytes;
  if (item.deadline != kNever) deadlines_.emplace(item.deadline, order);
  queue_.emplace_hint(queue_.end(), order, std::move(item));
  return std::nullopt;
}

template <typename Payload>
typename Batcher<Payload>::Decision Batcher<Payload>::Step(TimePoint now, int idle_workers) {
  Decision decision;
  TakeExpired(now, decision.refused);
  if (idle_workers > 0 && !queue_.empty()) {
    const int64_t share = (size() + idle_workers - 1) / idle_workers;
    const int64_t most = std::min<int64_t>(share, options_.max_batch_items);
    int64_t cost = 0;
    for (auto it = queue_.begin(); it != queue_.end();) {
      Item& item = it->second;
      if (item.is_cancelled()) {
        decision.refused.push_back({Item{}, Outcome::kCancelled});
        it = Take(it, decision.refused.back().item);
        continue;
      }
      const bool first = decision.dispatch.empty();
      if (!first && static_cast<int64_t>(decision.dispatch.size()) >= most) break;
      const bool fits = first || (item.bucket == decision.dispatch.front().bucket &&
                                  item.cost <= options_.max_batch_cost - cost);
      if (!fits) {
        ++it;
        continue;
      }
      cost += item.cost;
      decision.dispatch.emplace_back();
      it = Take(it, decision.dispatch.back());
    }
  }
  if (!deadlines_.empty()) decision.wake_at = deadlines_.begin()->first;
  return decision;
}

template <typename Payload>
std::vector<typename Batcher<Payload>::Refused> Batcher<Payload>::TakeCancelled() {
  std::vector<Refused> out;
  for (auto it = queue_.begin(); it != queue_.end();) {
    if (!it->second.is_cancelled()) {
      ++it;
      continue;
    }
    out.push_back({Item{}, Outcome::kCancelled});
    it = Take(it, out.back().item);
  }
  return out;
}

template <typename Payload>
std::vector<typename Batcher<Payload>::Refused> Batcher<Payload>::TakeAll(Outcome outcome) {
  std::vector<Refused> out;
  for (auto it = queue_.begin(); it != queue_.end();) {
    out.push_back({Item{}, outcome});
    it = Take(it, out.back().item);
  }
  return out;
}

template <typename Payload>
typename Batcher<Payload>::Queue::iterator Batcher<Payload>::Take(typename Queue::iterator it, Item& out) {
  bytes_ -= it->second.bytes;
  deadlines_.erase({it->second.deadline, it->first});
  out = std::move(it->second);
  return queue_.erase(it);
}

template <typename Payload>
void Batcher<Payload>::TakeExpired(TimePoint now, std::vector<Refused>& out) {
  while (!deadlines_.empty() && deadlines_.begin()->first <= now) {
    out.push_back({Item{}, Outcome::kExpired});
    Take(queue_.find(deadlines_.begin()->second), out.back().item);
  }
}

}  // namespace stance
