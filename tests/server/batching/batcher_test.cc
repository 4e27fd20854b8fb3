#include "server/batching/batcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <vector>

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
    retry_after = refused->retry_after;
    refused->item.done(outcome);
    return outcome;
  }

  // The numbers of the batch that one of `idle` free workers gets.
  std::vector<int> Step(int idle) {
    auto decision = batcher_.Step(now, idle);
    wake_at = decision.wake_at;
    if (!decision.dispatch.empty()) batch_ = decision.batch;
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

  // The last batch has run.
  void Finish() { batcher_.Finish(batch_); }

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
  Duration retry_after{};  // of the last refusal

 private:
  void Complete(std::vector<TestBatcher::Refused>& refused) {
    for (auto& each : refused) each.item.done(each.outcome);
  }

  const BatcherOptions options_;
  TestBatcher batcher_;
  uint64_t batch_ = 0;
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

TestItem Of(const std::string& client, Priority priority = Priority::kNormal) {
  TestItem item;
  item.client = client;
  item.priority = priority;
  return item;
}
TestItem Taking(Duration work, TimePoint deadline = kNever) {
  TestItem item;
  item.work = work;
  item.deadline = deadline;
  return item;
}

TEST(BatcherTest, RefusesBeyondTheCostCapButNotALargeItemAlone) {
  Puppet puppet({.max_queued_cost = 100});
  EXPECT_EQ(puppet.Admit(0, WithCost(500)), std::nullopt);
  EXPECT_EQ(puppet.Admit(1, WithCost(1)), Outcome::kQueueCost);
  puppet.Step(1);
  EXPECT_EQ(puppet.batcher().cost(), 0);
  EXPECT_EQ(puppet.Admit(2, WithCost(60)), std::nullopt);
  EXPECT_EQ(puppet.Admit(3, WithCost(41)), Outcome::kQueueCost);
  EXPECT_EQ(puppet.Admit(4, WithCost(40)), std::nullopt);
}

TEST(BatcherTest, AClientBeyondItsQuotaLeavesRoomForOthers) {
  Puppet puppet({.max_queued_items_per_client = 2});
  EXPECT_EQ(puppet.Admit(0, Of("a")), std::nullopt);
  EXPECT_EQ(puppet.Admit(1, Of("a")), std::nullopt);
  EXPECT_EQ(puppet.Admit(2, Of("a")), Outcome::kClientQuota);
  EXPECT_EQ(puppet.Admit(3, Of("b")), std::nullopt);
  puppet.Step(1);
  EXPECT_EQ(puppet.Admit(4, Of("a")), std::nullopt);
}

TEST(BatcherTest, ABatchTakesFromEachClientInTurn) {
  Puppet puppet({.max_batch_items = 3});
  for (int i = 0; i < 4; ++i) puppet.Admit(i, Of("flood"));
  puppet.Admit(4, Of("b"));
  puppet.Admit(5, Of("b", Priority::kInteractive));
  EXPECT_THAT(puppet.Step(1), ElementsAre(0, 5, 1));
  EXPECT_THAT(puppet.Step(1), ElementsAre(4, 2, 3));
}

TEST(BatcherTest, RefusesAtOnceWhatIsAheadOfWouldMakeLate) {
  Puppet puppet({.max_batch_items = 1});
  puppet.Admit(0, Taking(milliseconds(100)));
  EXPECT_THAT(puppet.Step(1), ElementsAre(0));
  puppet.now += milliseconds(40);
  puppet.Admit(1, Taking(milliseconds(50)));
  // 60 of the running one, 50 of the waiting one, 10 of its own.
  EXPECT_EQ(puppet.Admit(2, Taking(milliseconds(10), puppet.now + milliseconds(119))),
            Outcome::kTooMuchAhead);
  EXPECT_EQ(puppet.retry_after, milliseconds(1));
  EXPECT_EQ(puppet.Admit(3, Taking(milliseconds(10), puppet.now + milliseconds(120))), std::nullopt);
}

TEST(BatcherTest, AFloodAheadDoesNotMakeAnotherClientsRequestUnmeetable) {
  Puppet puppet({});
  for (int i = 0; i < 50; ++i) {
    TestItem item = Taking(milliseconds(100));
    item.client = "flood";
    puppet.Admit(i, std::move(item));
  }
  TestItem item = Taking(milliseconds(10), puppet.now + milliseconds(20));
  item.client = "other";
  EXPECT_EQ(puppet.Admit(50, std::move(item)), std::nullopt);
  item = Taking(milliseconds(10), puppet.now + milliseconds(20));
  item.client = "flood";
  EXPECT_EQ(puppet.Admit(51, std::move(item)), Outcome::kTooMuchAhead);
}

// An expectation that refuses everything would never be corrected: what would be refused while a worker is
// free runs now and then.
TEST(BatcherTest, NowAndThenTriesWhatItWouldRefuse) {
  Puppet puppet({});
  int admitted = 0;
  for (int i = 0; i < 80; ++i) {
    const auto outcome = puppet.Admit(i, Taking(milliseconds(100), puppet.now + milliseconds(99)));
    if (!outcome) {
      ++admitted;
      EXPECT_THAT(puppet.Step(1), ElementsAre(i));
    } else {
      EXPECT_EQ(*outcome, Outcome::kDeadlineShort);
    }
  }
  EXPECT_EQ(admitted, 1) << "the first that ran is not finished, and no worker is free";
  puppet.Finish();
  for (int i = 80; i < 160; ++i) {
    if (puppet.Admit(i, Taking(milliseconds(100), puppet.now + milliseconds(99)))) continue;
    ++admitted;
    EXPECT_THAT(puppet.Step(1), ElementsAre(i));
    puppet.Finish();
  }
  EXPECT_EQ(admitted, 1 + 10);
}

TEST(BatcherTest, AdmitsWhateverTheExpectationIfSoTold) {
  Puppet puppet({.refuse_unmeetable = false});
  EXPECT_EQ(puppet.Admit(0, Taking(milliseconds(100), puppet.now + milliseconds(1))), std::nullopt);
}

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
