#include "tests/server/batching/batcher_oracle.h"

#include <algorithm>
#include <set>

namespace stance::testing {
namespace {

constexpr int kAnyBucket = -1;
constexpr int64_t kAnyCost = int64_t{1} << 60;

}  // namespace

int64_t BatcherOracle::TagOf(const std::string& client) const {
  const auto it = tags_.find(client);
  return it == tags_.end() ? served_tag_ : it->second;
}

int64_t BatcherOracle::Sum(int64_t ModelItem::*field) const {
  int64_t sum = 0;
  for (const ModelItem& item : waiting_) sum += item.*field;
  return sum;
}

int64_t BatcherOracle::WorkBefore(const ModelItem& item) const {
  int64_t own = 0;
  std::map<std::string, int64_t> others;
  for (const ModelItem& each : waiting_) {
    if (each.client != item.client) {
      others[each.client] += each.work;
    } else if (each.priority >= item.priority) {
      own += each.work;
    }
  }
  int64_t before = own;
  for (const auto& [client, work] : others) {
    const int64_t room = TagOf(item.client) + own + item.work - TagOf(client);
    before += std::max<int64_t>(0, std::min(room, work));
  }
  return before;
}

// By bisection: the earliest time by which the workers have done `ahead`.
int64_t BatcherOracle::FreeAfter(int64_t now, int64_t ahead) const {
  std::vector<int64_t> free(static_cast<size_t>(options_.workers), now);
  size_t worker = 0;
  for (const auto& [index, end] : running_) free[worker++] = std::max(now, end);
  int64_t low = *std::min_element(free.begin(), free.end()), high = low + (int64_t{1} << 40);
  while (low < high) {
    const int64_t middle = low + (high - low) / 2;
    int64_t done = 0;
    for (const int64_t f : free) done += std::max<int64_t>(0, middle - f);
    if (done >= ahead) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

std::optional<BatcherOracle::Refusal> BatcherOracle::Admit(ModelItem item, int64_t now) {
  if (item.cancelled) return Refusal{Outcome::kCancelled};
  if (item.deadline <= now) return Refusal{Outcome::kExpired};
  if (static_cast<int64_t>(waiting_.size()) >= options_.max_queued_items) return Refusal{Outcome::kQueueFull};
  if (Sum(&ModelItem::bytes) + item.bytes > options_.max_queued_bytes) return Refusal{Outcome::kQueueBytes};
  if (!waiting_.empty() && Sum(&ModelItem::cost) + item.cost > options_.max_queued_cost) {
    return Refusal{Outcome::kQueueCost};
  }
  const int64_t own = std::count_if(waiting_.begin(), waiting_.end(),
                                    [&](const ModelItem& each) { return each.client == item.client; });
  const int64_t quota = options_.max_queued_items_per_client;
  if (quota > 0 && own >= quota) return Refusal{Outcome::kClientQuota};
  if (options_.refuse_unmeetable && item.deadline != kEndless) {
    const int64_t end = FreeAfter(now, WorkBefore(item)) + item.work;
    if (now + item.work > item.deadline) {
      const bool is_free = waiting_.empty() && static_cast<int>(running_.size()) < options_.workers;
      const bool is_probe = is_free && ++refused_while_free_ % 8 == 0;
      if (!is_probe) return Refusal{Outcome::kDeadlineShort};
    } else if (end > item.deadline) {
      return Refusal{Outcome::kTooMuchAhead, end - item.deadline};
    }
  }
  item.arrival = now;
  if (own == 0) tags_[item.client] = served_tag_;
  waiting_.push_back(item);
  return std::nullopt;
}

bool BatcherOracle::IsBefore(const ModelItem& a, const ModelItem& b) const {
  const int64_t aging = options_.priority_aging.count();
  return std::pair(a.arrival - a.priority * aging, a.number) <
         std::pair(b.arrival - b.priority * aging, b.number);
}

const ModelItem* BatcherOracle::FirstOf(const std::string& client, int bucket, int64_t most_cost) const {
  const ModelItem* first = nullptr;
  for (const ModelItem& item : waiting_) {
    if (item.client != client || item.cost > most_cost) continue;
    if (bucket != kAnyBucket && item.bucket != bucket) continue;
    if (first == nullptr || IsBefore(item, *first)) first = &item;
  }
  return first;
}

const ModelItem* BatcherOracle::Choose(bool leads, int bucket, int64_t most_cost) const {
  const ModelItem* chosen = nullptr;
  std::pair<int64_t, int> chosen_turn;
  for (const auto& [client, tag] : tags_) {
    const ModelItem* first = FirstOf(client, kAnyBucket, kAnyCost);
    const ModelItem* offer = leads ? first : FirstOf(client, bucket, most_cost);
    if (offer == nullptr) continue;
    const std::pair<int64_t, int> turn(tag + first->work, first->number);
    if (chosen != nullptr && chosen_turn < turn) continue;
    chosen = offer;
    chosen_turn = turn;
  }
  return chosen;
}

void BatcherOracle::Remove(int number) {
  const auto it = std::find_if(waiting_.begin(), waiting_.end(),
                               [&](const ModelItem& item) { return item.number == number; });
  const std::string client = it->client;
  waiting_.erase(it);
  const bool waits_still = std::any_of(waiting_.begin(), waiting_.end(),
                                       [&](const ModelItem& item) { return item.client == client; });
  if (!waits_still) tags_.erase(client);
}

BatcherOracle::Step BatcherOracle::Advance(int64_t now, int idle_workers) {
  Step step;
  std::vector<int> expired;
  for (const ModelItem& item : waiting_) {
    if (item.deadline <= now) expired.push_back(item.number);
  }
  for (const int number : expired) {
    step.refused[number] = Outcome::kExpired;
    Remove(number);
  }
  const auto waiting = static_cast<int64_t>(waiting_.size());
  int64_t room = options_.max_batch_cost, work = 0;
  int bucket = kAnyBucket;
  while (idle_workers > 0) {
    const auto taken = static_cast<int64_t>(step.batch.size());
    // Each free worker's share of the queue, rounded up.
    if (taken >= options_.max_batch_items || taken * idle_workers >= waiting) break;
    const ModelItem* next = Choose(step.batch.empty(), bucket, room);
    if (next == nullptr) break;
    const ModelItem item = *next;
    if (item.cancelled) {
      step.refused[item.number] = Outcome::kCancelled;
    } else {
      step.batch.push_back(item.number);
      bucket = item.bucket;
      room -= item.cost;
      work += item.work;
      tags_[item.client] += item.work;
      served_tag_ = std::max(served_tag_, tags_[item.client]);
    }
    Remove(item.number);
  }
  if (!step.batch.empty()) running_[dispatched_++] = now + work;
  for (const ModelItem& item : waiting_) step.wake_at = std::min(step.wake_at, item.deadline);
  return step;
}

void BatcherOracle::Cancel(int number) {
  for (ModelItem& item : waiting_) item.cancelled |= item.number == number;
}

std::vector<int> BatcherOracle::TakeCancelled() {
  std::vector<int> numbers;
  for (const ModelItem& item : waiting_) {
    if (item.cancelled) numbers.push_back(item.number);
  }
  for (const int number : numbers) Remove(number);
  return numbers;
}

}  // namespace stance::testing
