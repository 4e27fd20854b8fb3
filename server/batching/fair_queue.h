// Whose turn it is: an order of waiting items that is fair between clients and heeds priorities within each.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "core/base/clock.h"

namespace stance {

// How urgent an item is among those of its own client.
enum class Priority { kBulk, kNormal, kInteractive };
inline constexpr size_t kPriorities = 3;

// What the order depends on.
struct QueueEntry {
  uint64_t id = 0;     // ascends with arrival
  std::string client;  // items of equal clients share their client's turns
  Priority priority = Priority::kNormal;
  TimePoint arrival{};
  Duration work{1};  // expected; what its client is charged. At least 1 ns
  int64_t cost = 0;  // share of a batch
  int bucket = 0;    // only items of one bucket share a batch
};

// Between clients: self-clocked fair queueing (Golestani, 1994). Each client has a tag, the work it has been
// served, and the lowest "tag + work of its first item" goes first; a client that comes anew starts at the
// tag of the last item served, so that nobody saves turns up or owes any. Within a client: by arrival, where
// each step of priority counts as having arrived `aging` earlier.
//
// Invariants: (1) of two clients that both always have an item which fits, neither is served more than the
// other by more than the work of one batch and of each one's largest item; (2) an item is overtaken only by
// items of its client that arrive less than 2 x aging after it, and by other clients' turns. Hence none
// starves. Not thread-safe.
class FairQueue {
 public:
  explicit FairQueue(Duration aging) : aging_(aging) {}

  void Add(QueueEntry entry);
  // Takes an item out; Serve charges its work to its client. REQUIRES: `id` is in the queue.
  void Drop(uint64_t id) { Take(id, false); }
  void Serve(uint64_t id) { Take(id, true); }

  // Whose turn it is; nothing if nobody waits.
  std::optional<uint64_t> Next() const;
  // Who may share a batch of that bucket with room for `most_cost`: clients in the order of their turns, of
  // each its first item that fits.
  std::optional<uint64_t> Companion(int bucket, int64_t most_cost) const;

  int64_t clients() const { return static_cast<int64_t>(clients_.size()); }
  // Items of that client that wait.
  int64_t CountOf(const std::string& client) const;
  // Work that would be served before an item that came now. Less urgent items of its own client are left
  // out, although those that have waited long would go first: a lower bound.
  Duration WorkBefore(const std::string& client, Priority priority, Duration work) const;

 private:
  using Rank = std::pair<TimePoint, uint64_t>;  // arrival less priority, id
  struct Client {
    std::map<Rank, QueueEntry> items;                // never empty
    std::array<Duration, kPriorities> waiting = {};  // work of items, by priority
    Duration tag{};                                  // work that it was served

    Duration total_waiting() const { return waiting[0] + waiting[1] + waiting[2]; }
  };
  using Clients = std::unordered_map<std::string, Client>;
  using Turn = std::pair<Duration, uint64_t>;  // tag + work of the first item, and that item

  struct Place {
    const std::string* client;  // the key in clients_
    Rank rank;
  };

  Rank RankOf(const QueueEntry& entry) const;
  static Turn TurnOf(const Client& client);
  void Take(uint64_t id, bool served);

  const Duration aging_;
  Clients clients_;                             // those with items
  std::unordered_map<uint64_t, Place> places_;  // of each item
  std::map<Turn, const Client*> turns_;         // one of each client
  Duration served_tag_{};                       // of the last item served
};

}  // namespace stance
