// What a Batcher should do, by its definition and nothing else.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/batching/batcher.h"

namespace stance::testing {

// What the oracle knows of an item.
struct ModelItem {
  int number = 0;  // ascends with arrival
  std::string client;
  int priority = 0;  // 0 to 2
  int64_t work = 1;  // nanoseconds, as every time here
  int64_t cost = 1;
  int64_t bytes = 0;
  int bucket = 0;
  int64_t deadline = 0;  // kEndless: none
  bool cancelled = false;
  int64_t arrival = 0;  // set by the oracle
};
inline constexpr int64_t kEndless = int64_t{1} << 60;

// One list, searched from end to end for everything; slow, and so short that it can be read beside the
// documentation. Not thread-safe.
class BatcherOracle {
 public:
  struct Refusal {
    Outcome outcome;
    int64_t retry_after = 0;
  };
  struct Step {
    std::vector<int> batch;          // numbers
    std::map<int, Outcome> refused;  // by number
    int64_t wake_at = kEndless;
  };

  explicit BatcherOracle(const BatcherOptions& options) : options_(options) {}

  std::optional<Refusal> Admit(ModelItem item, int64_t now);
  Step Advance(int64_t now, int idle_workers);
  // Of the batch dispatched as the `index`-th.
  void Finish(int index) { running_.erase(index); }
  void Cancel(int number);
  std::vector<int> TakeCancelled();

  size_t size() const { return waiting_.size(); }

 private:
  int64_t TagOf(const std::string& client) const;
  int64_t Sum(int64_t ModelItem::*field) const;
  int64_t WorkBefore(const ModelItem& item) const;
  int64_t FreeAfter(int64_t now, int64_t ahead) const;
  // The order of one client's items, and of two clients' turns by their first ones.
  bool IsBefore(const ModelItem& a, const ModelItem& b) const;
  const ModelItem* FirstOf(const std::string& client, int bucket, int64_t most_cost) const;
  const ModelItem* Choose(bool leads, int bucket, int64_t most_cost) const;
  void Remove(int number);

  const BatcherOptions options_;
  std::vector<ModelItem> waiting_;       // by arrival
  std::map<std::string, int64_t> tags_;  // of clients that wait
  int64_t served_tag_ = 0;
  std::map<int, int64_t> running_;  // expected ends
  int dispatched_ = 0;
  int refused_while_free_ = 0;
};

}  // namespace stance::testing
