// Random events against a Batcher and its oracle side by side, and against its numbered invariants.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "server/batching/batcher.h"
#include "tests/server/batching/batcher_oracle.h"

namespace stance {
namespace {

using testing::BatcherOracle;
using testing::kEndless;
using testing::ModelItem;

// Every time is a multiple of it, so that up to four workers divide it.
constexpr int64_t kTick = 12;

TimePoint At(int64_t time) { return time == kEndless ? kNever : TimePoint(Duration(time)); }

BatcherOptions RandomOptions(Random& random) {
  BatcherOptions options;
  options.workers = static_cast<int>(1 + random.Below(4));
  options.max_batch_items = static_cast<int>(1 + random.Below(5));
  options.max_batch_cost = 1 + random.Below(40);
  options.max_queued_items = 1 + random.Below(20);
  options.max_queued_bytes = 1 + random.Below(200);
  options.max_queued_cost = 1 + random.Below(200);
  options.max_queued_items_per_client = random.Below(6);
  options.priority_aging = Duration(kTick * random.Below(30));
  options.refuse_unmeetable = random.Chance(0.7);
  return options;
}

// How often each thing happened, so that a test can tell that it has tried everything.
struct Coverage {
  std::map<Outcome, int> outcomes;
  int shared_batches = 0;
  int late_wake_ups = 0;  // steps that left something to expire
};

// A batcher, its oracle, and what became of every item.
class SideBySide {
 public:
  SideBySide(Random& random, Coverage& coverage)
      : random_(random),
        coverage_(coverage),
        options_(RandomOptions(random)),
        batcher_(options_),
        oracle_(options_) {}
  ~SideBySide() { Complete(batcher_.TakeAll(Outcome::kShuttingDown)); }

  void RandomEvent() {
    switch (random_.Below(7)) {
      case 0:
      case 1:
      case 2:
        return Admit();
      case 3:
        return Step();
      case 4:
        now_ += kTick * random_.Below(8);
        return;
      case 5:
        if (running_.empty()) return;
        return Finish(random_.Below(static_cast<int64_t>(running_.size())));
      case 6:
        return Cancel();
    }
  }

  void CheckTotals() const {
    ASSERT_EQ(batcher_.size(), static_cast<int64_t>(oracle_.size()));
    ASSERT_LE(batcher_.size(), options_.max_queued_items);
    ASSERT_LE(batcher_.bytes(), options_.max_queued_bytes);
    ASSERT_TRUE(batcher_.cost() <= options_.max_queued_cost || batcher_.size() == 1) << batcher_.cost();
  }

  // Runs until nothing waits: with a worker always free, each step serves or refuses something.
  void RunOut() {
    for (int steps = 0; batcher_.size() > 0; ++steps) {
      ASSERT_LT(steps, 1000);
      while (!running_.empty()) Finish(0);
      Step();
      if (::testing::Test::HasFatalFailure()) return;
    }
    EXPECT_EQ(batcher_.bytes(), 0);
    EXPECT_EQ(batcher_.cost(), 0);
    EXPECT_EQ(batcher_.clients(), 0);
    for (size_t i = 0; i < items_.size(); ++i) {
      const std::vector<Outcome>& outcomes = outcomes_[static_cast<int>(i)];
      EXPECT_EQ(outcomes.size(), 1u) << i;
      for (const Outcome outcome : outcomes) ++coverage_.outcomes[outcome];
    }
  }

 private:
  void Admit() {
    ModelItem model;
    model.number = static_cast<int>(items_.size());
    model.client = std::string(1, static_cast<char>('a' + random_.Below(4)));
    model.priority = static_cast<int>(random_.Below(3));
    model.work = kTick * (1 + random_.Below(10));
    model.cost = 1 + random_.Below(20);
    model.bytes = random_.Below(30);
    model.bucket = static_cast<int>(random_.Below(2));
    model.deadline = random_.Chance(0.7) ? now_ + kTick * random_.Below(60) : kEndless;
    model.cancelled = random_.Chance(0.02);
    items_.push_back(model);
    flags_.push_back(std::make_shared<std::atomic<bool>>(model.cancelled));

    BatchItem<int> item;
    item.payload = model.number;
    item.client = model.client;
    item.priority = static_cast<Priority>(model.priority);
    item.work = Duration(model.work);
    item.cost = model.cost;
    item.bytes = model.bytes;
    item.bucket = model.bucket;
    item.deadline = At(model.deadline);
    item.cancelled = flags_.back();
    item.done =
        Completion([this, number = model.number](Outcome outcome) { outcomes_[number].push_back(outcome); });

    const auto expected = oracle_.Admit(model, now_);
    auto refused = batcher_.Admit(std::move(item), At(now_));
    if (refused) refused->item.done(refused->outcome);
    ASSERT_EQ(refused.has_value(), expected.has_value()) << "item " << model.number;
    if (!refused) {
      admitted_.push_back(model.number);
      return;
    }
    ASSERT_EQ(refused->outcome, expected->outcome) << "item " << model.number;
    ASSERT_EQ(refused->retry_after.count(), expected->retry_after) << "item " << model.number;
  }

  void Step() {
    const int idle = options_.workers - static_cast<int>(running_.size());
    auto decision = batcher_.Step(At(now_), idle);
    const BatcherOracle::Step expected = oracle_.Advance(now_, idle);
    std::vector<int> batch;
    int64_t cost = 0;
    for (BatchItem<int>& item : decision.dispatch) {
      const ModelItem& model = items_[static_cast<size_t>(item.payload)];
      batch.push_back(item.payload);
      cost += model.cost;
      EXPECT_LT(now_, model.deadline) << "item " << item.payload << " runs after its deadline";
      EXPECT_FALSE(flags_[static_cast<size_t>(item.payload)]->load())
          << "item " << item.payload << " runs after its cancellation";
      EXPECT_EQ(model.bucket, items_[static_cast<size_t>(batch.front())].bucket);
      item.done(Outcome::kExecuted);
    }
    std::map<int, Outcome> refused;
    for (const auto& each : decision.refused) refused[each.item.payload] = each.outcome;
    Complete(std::move(decision.refused));
    if (!batch.empty()) running_.push_back({decision.batch, dispatched_++});
    ASSERT_LE(static_cast<int>(batch.size()), options_.max_batch_items);
    ASSERT_TRUE(batch.size() <= 1 || cost <= options_.max_batch_cost) << cost;
    ASSERT_EQ(batch, expected.batch);
    ASSERT_EQ(refused, expected.refused);
    ASSERT_EQ(decision.wake_at, At(expected.wake_at));
    coverage_.shared_batches += batch.size() > 1;
    coverage_.late_wake_ups += decision.wake_at != kNever;
  }

  void Finish(int64_t place) {
    const auto it = running_.begin() + place;
    batcher_.Finish(it->first);
    oracle_.Finish(it->second);
    running_.erase(it);
  }

  void Cancel() {
    if (!admitted_.empty()) {
      const int number =
          admitted_[static_cast<size_t>(random_.Below(static_cast<int64_t>(admitted_.size())))];
      flags_[static_cast<size_t>(number)]->store(true);
      oracle_.Cancel(number);
    }
    if (random_.Chance(0.5)) return;
    auto refused = batcher_.TakeCancelled();
    std::vector<int> numbers;
    for (const auto& each : refused) numbers.push_back(each.item.payload);
    Complete(std::move(refused));
    ASSERT_EQ(numbers, oracle_.TakeCancelled());
  }

  static void Complete(std::vector<Batcher<int>::Refused> refused) {
    for (auto& each : refused) each.item.done(each.outcome);
  }

  Random& random_;
  Coverage& coverage_;
  const BatcherOptions options_;
  Batcher<int> batcher_;
  BatcherOracle oracle_;
  int64_t now_ = 1'000'000 * kTick;
  std::vector<ModelItem> items_;  // all there ever were, by number
  std::vector<std::shared_ptr<std::atomic<bool>>> flags_;
  std::vector<int> admitted_;
  std::vector<std::pair<uint64_t, int>> running_;  // the batcher's number and the oracle's
  int dispatched_ = 0;
  std::map<int, std::vector<Outcome>> outcomes_;
};

class BatcherModelTest : public ::testing::TestWithParam<uint64_t> {};

TEST_P(BatcherModelTest, DoesWhatItsOracleDoes) {
  constexpr uint64_t kSequences = 500;
  Coverage coverage;
  for (uint64_t i = 0; i < kSequences; ++i) {
    const uint64_t seed = GetParam() * kSequences + i;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    SideBySide both(random, coverage);
    for (int event = 0; event < 200; ++event) {
      both.RandomEvent();
      both.CheckTotals();
      ASSERT_FALSE(HasFailure()) << "event " << event;
    }
    both.RunOut();
    ASSERT_FALSE(HasFailure());
  }
  for (const Outcome outcome : {Outcome::kExecuted, Outcome::kQueueFull, Outcome::kQueueBytes,
                                Outcome::kQueueCost, Outcome::kClientQuota, Outcome::kTooMuchAhead,
                                Outcome::kDeadlineShort, Outcome::kExpired, Outcome::kCancelled}) {
    EXPECT_GT(coverage.outcomes[outcome], 100) << static_cast<int>(outcome);
  }
  EXPECT_GT(coverage.shared_batches, 100);
  EXPECT_GT(coverage.late_wake_ups, 100);
}

INSTANTIATE_TEST_SUITE_P(Blocks, BatcherModelTest, ::testing::Range<uint64_t>(0, 8));

}  // namespace
}  // namespace stance
