#include "server/batching/batcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <vector>

#include "core/base/random.h"

namespace stance {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Items here carry their number; each is completed by the test as the batcher's owner would.
using TestBatcher = Batcher<int>;
using TestItem = BatchItem<int>;

constexpr TimePoint kStart = TimePoint() + std::chrono::hours(1);

// Drives a batcher one step at a time and keeps what became of each item.
class Puppet {
 public:
  explicit Puppet(const BatcherOptions& options) : options_(options), batcher_(options) {}
  // What a test leaves waiting must still be completed.
  ~Puppet() { TakeAll(Outcome::kShuttingDown); }

  // The outcome if refused at once.
  std::optional<Outcome> Admit(int number, TestItem item = {}) {
    item.payload = number;
    item.done = Completion([this, number](Outcome outcome) { outcomes_[number].push_back(outcome); });
    auto refused = batcher_.Admit(std::move(item), now);
    if (!refused) return std::nullopt;
    const Outcome outcome = refused->outcome;
    refused->item.done(outcome);
    return outcome;
  }

  // The numbers of the batch that one of `idle` free workers gets.
  std::vector<int> Step(int idle) {
    auto decision = batcher_.Step(now, idle);
    wake_at = decision.wake_at;
    int64_t cost = 0;
    std::vector<int> numbers;
    for (TestItem& item : decision.dispatch) {
      EXPECT_LT(now, item.deadline) << "item " << item.payload << " dispatched after its deadline";
      EXPECT_FALSE(item.is_cancelled()) << "item " << item.payload << " dispatched after its cancellation";
      EXPECT_EQ(item.bucket, decision.dispatch.front().bucket);
      cost += item.cost;
      numbers.push_back(item.payload);
      item.done(Outcome::kExecuted);
    }
    EXPECT_LE(static_cast<int>(numbers.size()), options_.max_batch_items);
    EXPECT_TRUE(numbers.size() <= 1 || cost <= options_.max_batch_cost) << "cost " << cost;
    Complete(decision.refused);
    return numbers;
  }

  void TakeCancelled() {
    auto refused = batcher_.TakeCancelled();
    Complete(refused);
  }
  void TakeAll(Outcome outcome) {
    auto refused = batcher_.TakeAll(outcome);
    Complete(refused);
  }

  std::vector<Outcome> OutcomesOf(int number) const {
    auto it = outcomes_.find(number);
    return it == outcomes_.end() ? std::vector<Outcome>() : it->second;
  }
  const TestBatcher& batcher() const { return batcher_; }

  TimePoint now = kStart;
  TimePoint wake_at = kNever;

 private:
  void Complete(std::vector<TestBatcher::Refused>& refused) {
    for (auto& each : refused) each.item.done(each.outcome);
  }

  const BatcherOptions options_;
  TestBatcher batcher_;
  std::map<int, std::vector<Outcome>> outcomes_;
};

TestItem WithCost(int64_t cost) {
  TestItem item;
  item.cost = cost;
  return item;
}
TestItem WithBytes(int64_t bytes) {
  TestItem item;
  item.bytes = bytes;
  return item;
}
TestItem WithDeadline(TimePoint deadline) {
  TestItem item;
  item.deadline = deadline;
  return item;
}
TestItem InBucket(int bucket) {
  TestItem item;
  item.bucket = bucket;
  return item;
}

TEST(BatcherTest, FormsNoBatchWhileNoWorkerIsFree) {
  Puppet puppet({});
  puppet.Admit(0);
  EXPECT_THAT(puppet.Step(0), IsEmpty());
  EXPECT_EQ(puppet.batcher().size(), 1);
  EXPECT_THAT(puppet.Step(1), ElementsAre(0));
  EXPECT_EQ(puppet.batcher().size(), 0);
}

TEST(BatcherTest, BatchesInOrderOfArrivalUpToTheItemCap) {
  Puppet puppet({.max_batch_items = 3});
  for (int i = 0; i < 5; ++i) puppet.Admit(i);
  EXPECT_THAT(puppet.Step(1), ElementsAre(0, 1, 2));
  EXPECT_THAT(puppet.Step(1), ElementsAre(3, 4));
  EXPECT_THAT(puppet.Step(1), IsEmpty());
}

TEST(BatcherTest, FillsABatchUpToTheCostCapWithWhatFits) {
  Puppet puppet({.max_batch_cost = 10});
  puppet.Admit(0, WithCost(6));
  puppet.Admit(1, WithCost(5));
  puppet.Admit(2, WithCost(4));
  EXPECT_THAT(puppet.Step(1), ElementsAre(0, 2));
  EXPECT_THAT(puppet.Step(1), ElementsAre(1));
}

TEST(BatcherTest, AnItemBeyondTheCostCapRunsAlone) {
  Puppet puppet({.max_batch_cost = 10});
  puppet.Admit(0, WithCost(50));
  puppet.Admit(1, WithCost(1));
  EXPECT_THAT(puppet.Step(1), ElementsAre(0));
  EXPECT_THAT(puppet.Step(1), ElementsAre(1));
}

TEST(BatcherTest, BucketsDoNotMixAndTheOldestGoesFirst) {
  Puppet puppet({});
  puppet.Admit(0, InBucket(1));
  puppet.Admit(1, InBucket(2));
  puppet.Admit(2, InBucket(1));
  EXPECT_THAT(puppet.Step(1), ElementsAre(0, 2));
  EXPECT_THAT(puppet.Step(1), ElementsAre(1));
}

TEST(BatcherTest, SeveralFreeWorkersShareTheQueue) {
  Puppet puppet({});
  for (int i = 0; i < 4; ++i) puppet.Admit(i);
  EXPECT_THAT(puppet.Step(2), ElementsAre(0, 1));
  EXPECT_THAT(puppet.Step(1), ElementsAre(2, 3));
}

TEST(BatcherTest, RefusesBeyondTheItemCap) {
  Puppet puppet({.max_queued_items = 2});
  EXPECT_EQ(puppet.Admit(0), std::nullopt);
  EXPECT_EQ(puppet.Admit(1), std::nullopt);
  EXPECT_EQ(puppet.Admit(2), Outcome::kQueueFull);
  puppet.Step(2);
  EXPECT_EQ(puppet.Admit(3), std::nullopt);
}

TEST(BatcherTest, RefusesBeyondTheByteCapAndGivesBytesBack) {
  Puppet puppet({.max_queued_bytes = 100});
  EXPECT_EQ(puppet.Admit(0, WithBytes(60)), std::nullopt);
  EXPECT_EQ(puppet.Admit(1, WithBytes(41)), Outcome::kQueueBytes);
  EXPECT_EQ(puppet.Admit(2, WithBytes(40)), std::nullopt);
  EXPECT_EQ(puppet.batcher().bytes(), 100);
  puppet.Step(1);
  EXPECT_EQ(puppet.batcher().bytes(), 0);
}

TEST(BatcherTest, RefusesWhatIsExpiredOrCancelledOnArrival) {
  Puppet puppet({});
  EXPECT_EQ(puppet.Admit(0, WithDeadline(kStart)), Outcome::kExpired);
  TestItem cancelled;
  cancelled.cancelled = std::make_shared<std::atomic<bool>>(true);
  EXPECT_EQ(puppet.Admit(1, std::move(cancelled)), Outcome::kCancelled);
  EXPECT_EQ(puppet.batcher().size(), 0);
}

TEST(BatcherTest, ExpiresAtTheDeadlineThatItAskedToBeWokenAt) {
  Puppet puppet({});
  puppet.Admit(0, WithDeadline(kStart + milliseconds(20)));
  puppet.Admit(1, WithDeadline(kStart + milliseconds(10)));
  puppet.Admit(2);
  puppet.Step(0);
  EXPECT_EQ(puppet.wake_at, kStart + milliseconds(10));
  puppet.now = puppet.wake_at;
  puppet.Step(0);
  EXPECT_THAT(puppet.OutcomesOf(1), ElementsAre(Outcome::kExpired));
  EXPECT_THAT(puppet.OutcomesOf(0), IsEmpty());
  EXPECT_EQ(puppet.wake_at, kStart + milliseconds(20));
  puppet.now = puppet.wake_at;
  EXPECT_THAT(puppet.Step(1), ElementsAre(2));
  EXPECT_THAT(puppet.OutcomesOf(0), ElementsAre(Outcome::kExpired));
  EXPECT_EQ(puppet.wake_at, kNever);
}

TEST(BatcherTest, CancelledItemsLeaveBySweepOrAtDispatch) {
  Puppet puppet({});
  auto flag_a = std::make_shared<std::atomic<bool>>(false);
  auto flag_b = std::make_shared<std::atomic<bool>>(false);
  TestItem a, b;
  a.cancelled = flag_a;
  b.cancelled = flag_b;
  puppet.Admit(0, std::move(a));
  puppet.Admit(1, std::move(b));
  puppet.Admit(2);
  flag_a->store(true);
  puppet.TakeCancelled();
  EXPECT_THAT(puppet.OutcomesOf(0), ElementsAre(Outcome::kCancelled));
  flag_b->store(true);
  EXPECT_THAT(puppet.Step(1), ElementsAre(2));
  EXPECT_THAT(puppet.OutcomesOf(1), ElementsAre(Outcome::kCancelled));
}

TEST(BatcherTest, TakeAllGivesEverythingBack) {
  Puppet puppet({});
  puppet.Admit(0, WithBytes(3));
  puppet.Admit(1, WithDeadline(kStart + milliseconds(1)));
  puppet.TakeAll(Outcome::kShuttingDown);
  EXPECT_THAT(puppet.OutcomesOf(0), ElementsAre(Outcome::kShuttingDown));
  EXPECT_THAT(puppet.OutcomesOf(1), ElementsAre(Outcome::kShuttingDown));
  EXPECT_EQ(puppet.batcher().size(), 0);
  EXPECT_EQ(puppet.batcher().bytes(), 0);
  puppet.Step(1);
  EXPECT_EQ(puppet.wake_at, kNever);
}

// Random events against the numbered invariants of Batcher; Puppet::Step checks (3) and (4).
class BatcherRandomTest : public ::testing::TestWithParam<int> {};

TEST_P(BatcherRandomTest, KeepsItsInvariants) {
  Random random(GetParam());
  BatcherOptions options;
  options.max_batch_items = static_cast<int>(1 + random.Below(5));
  options.max_batch_cost = 1 + random.Below(40);
  options.max_queued_items = 1 + random.Below(20);
  options.max_queued_bytes = 1 + random.Below(200);
  Puppet puppet(options);
  std::vector<std::shared_ptr<std::atomic<bool>>> flags;
  int count = 0;
  for (int event = 0; event < 2000; ++event) {
    switch (random.Below(5)) {
      case 0:
      case 1: {
        TestItem item;
        item.cost = 1 + random.Below(20);
        item.bytes = random.Below(30);
        item.bucket = static_cast<int>(random.Below(3));
        if (random.Chance(0.7)) item.deadline = puppet.now + milliseconds(random.Below(30));
        auto flag = std::make_shared<std::atomic<bool>>(false);
        flags.push_back(flag);
        item.cancelled = flag;
        puppet.Admit(count++, std::move(item));
        break;
      }
      case 2:
        puppet.Step(static_cast<int>(random.Below(4)));
        break;
      case 3:
        puppet.now += milliseconds(random.Below(8));
        break;
      case 4:
        if (!flags.empty()) flags[static_cast<size_t>(random.Below(count))]->store(true);
        if (random.Chance(0.5)) puppet.TakeCancelled();
        break;
    }
    ASSERT_LE(puppet.batcher().size(), options.max_queued_items);
    ASSERT_LE(puppet.batcher().bytes(), options.max_queued_bytes);
    ASSERT_GE(puppet.batcher().bytes(), 0);
  }
  while (puppet.batcher().size() > 0) puppet.Step(1);
  EXPECT_EQ(puppet.batcher().bytes(), 0);
  for (int i = 0; i < count; ++i) EXPECT_EQ(puppet.OutcomesOf(i).size(), 1u) << "item " << i;
}

INSTANTIATE_TEST_SUITE_P(Seeds, BatcherRandomTest, ::testing::Range(0, 20));

TEST(CompletionDeathTest, ASecondCallOrNoneAborts) {
  EXPECT_DEATH(
      {
        Completion done([](Outcome) {});
        done(Outcome::kExecuted);
        done(Outcome::kExecuted);
      },
      "STANCE_CHECK failed");
  EXPECT_DEATH({ Completion dropped([](Outcome) {}); }, "STANCE_CHECK failed");
}

TEST(CompletionTest, MovesItsDuty) {
  int calls = 0;
  Completion first([&calls](Outcome) { ++calls; });
  Completion second(std::move(first));
  EXPECT_TRUE(second.pending());
  second(Outcome::kExecuted);
  EXPECT_FALSE(second.pending());
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace stance
