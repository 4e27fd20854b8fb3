#include "server/batching/fair_queue.h"

#include <algorithm>

#include "core/base/check.h"

namespace stance {

FairQueue::Rank FairQueue::RankOf(const QueueEntry& entry) const {
  return {entry.arrival - static_cast<int>(entry.priority) * aging_, entry.id};
}

FairQueue::Turn FairQueue::TurnOf(const Client& client) {
  const QueueEntry& first = client.items.begin()->second;
  return {client.tag + first.work, first.id};
}

void FairQueue::Add(QueueEntry entry) {
  STANCE_CHECK(entry.work >= Duration(1));
  const auto [it, is_new] = clients_.try_emplace(entry.client);
  Client& client = it->second;
  if (is_new) {
    client.tag = served_tag_;
  } else {
    turns_.erase(TurnOf(client));
  }
  const Rank rank = RankOf(entry);
  STANCE_CHECK(places_.try_emplace(entry.id, Place{&it->first, rank}).second);
  client.waiting[static_cast<size_t>(entry.priority)] += entry.work;
  client.items.emplace(rank, std::move(entry));
  turns_.emplace(TurnOf(client), &client);
}

void FairQueue::Take(uint64_t id, bool served) {
  const auto place = places_.find(id);
  STANCE_CHECK(place != places_.end());
  const auto it = clients_.find(*place->second.client);
  Client& client = it->second;
  turns_.erase(TurnOf(client));
  const auto item = client.items.find(place->second.rank);
  const QueueEntry& entry = item->second;
  client.waiting[static_cast<size_t>(entry.priority)] -= entry.work;
  if (served) {
    client.tag += entry.work;
    served_tag_ = std::max(served_tag_, client.tag);
  }
  client.items.erase(item);
  places_.erase(place);
  if (client.items.empty()) {
    clients_.erase(it);  // its tag is at most served_tag_, where it would start again
  } else {
    turns_.emplace(TurnOf(client), &client);
  }
}

std::optional<uint64_t> FairQueue::Next() const {
  if (turns_.empty()) return std::nullopt;
  return turns_.begin()->first.second;
}

std::optional<uint64_t> FairQueue::Companion(int bucket, int64_t most_cost) const {
  for (const auto& [turn, client] : turns_) {
    for (const auto& [rank, entry] : client->items) {
      if (entry.bucket == bucket && entry.cost <= most_cost) return entry.id;
    }
  }
  return std::nullopt;
}

int64_t FairQueue::CountOf(const std::string& client) const {
  const auto it = clients_.find(client);
  return it == clients_.end() ? 0 : static_cast<int64_t>(it->second.items.size());
}

Duration FairQueue::WorkBefore(const std::string& client, Priority priority, Duration work) const {
  Duration before{};
  Duration tag = served_tag_;
  const auto own = clients_.find(client);
  if (own != clients_.end()) {
    tag = own->second.tag;
    for (size_t p = static_cast<size_t>(priority); p < kPriorities; ++p) before += own->second.waiting[p];
  }
  // The tag at which the item will have been served: whatever the others can be served up to it goes first.
  const Duration end = tag + before + work;
  for (const auto& [name, other] : clients_) {
    if (name == client) continue;
    before += std::clamp(end - other.tag, Duration(0), other.total_waiting());
  }
  return before;
}

}  // namespace stance
