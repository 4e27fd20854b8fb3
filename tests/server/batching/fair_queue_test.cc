#include "server/batching/fair_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "core/base/random.h"

namespace stance {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;

constexpr TimePoint kStart = TimePoint() + std::chrono::hours(1);
constexpr int64_t kAnyCost = 1'000'000;

// A queue with a time of its own, whose items take their numbers in the order of their arrival.
class Line {
 public:
  explicit Line(Duration aging = seconds(5)) : queue_(aging) {}

  uint64_t Add(const std::string& client, milliseconds work, Priority priority = Priority::kNormal,
               int64_t cost = 1, int bucket = 0) {
    queue_.Add({next_, client, priority, now, work, cost, bucket});
    return next_++;
  }
  // Serves them one by one.
  std::vector<uint64_t> ServeAll() {
    std::vector<uint64_t> served;
    while (const auto id = queue_.Next()) {
      queue_.Serve(*id);
      served.push_back(*id);
    }
    return served;
  }

  FairQueue& queue() { return queue_; }

  TimePoint now = kStart;

 private:
  FairQueue queue_;
  uint64_t next_ = 0;
};

TEST(FairQueueTest, OneClientIsServedInOrderOfArrival) {
  Line line;
  for (int i = 0; i < 4; ++i) line.Add("a", milliseconds(5 - i));
  EXPECT_THAT(line.ServeAll(), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(line.queue().Next(), std::nullopt);
}

TEST(FairQueueTest, ClientsTakeTurnsHoweverManyEachHasWaiting) {
  Line line;
  for (int i = 0; i < 4; ++i) line.Add("flood", milliseconds(10));
  line.Add("b", milliseconds(10));
  line.Add("c", milliseconds(10));
  EXPECT_THAT(line.ServeAll(), ElementsAre(0, 4, 5, 1, 2, 3));
}

TEST(FairQueueTest, TurnsAreOfWorkAndNotOfItems) {
  Line line;
  for (int i = 0; i < 2; ++i) line.Add("large", milliseconds(30));
  for (int i = 0; i < 6; ++i) line.Add("small", milliseconds(10));
  // Ends at 30 and 60 against 10, 20, ... 60; the earlier arrival decides where they are equal.
  EXPECT_THAT(line.ServeAll(), ElementsAre(2, 3, 0, 4, 5, 6, 1, 7));
}

TEST(FairQueueTest, WhoComesAnewNeitherHasSavedTurnsUpNorOwesAny) {
  Line line;
  for (int i = 0; i < 5; ++i) line.Add("old", milliseconds(10));
  for (int i = 0; i < 3; ++i) line.queue().Serve(*line.queue().Next());
  const uint64_t fresh = line.Add("new", milliseconds(10));
  line.Add("new", milliseconds(10));
  EXPECT_THAT(line.ServeAll(), ElementsAre(3, fresh, 4, fresh + 1));
  // It was served and is gone; what it comes back with stands as anyone's.
  line.Add("old", milliseconds(10));
  line.Add("new", milliseconds(10));
  EXPECT_THAT(line.ServeAll(), ElementsAre(7, 8));
}

// An endless row of clients that nobody has seen before, each with less work than the one that waits.
TEST(FairQueueTest, NewClientsWithoutEndStarveNobody) {
  Line line;
  const uint64_t patient = line.Add("patient", milliseconds(100));
  int served = 0;
  while (true) {
    line.Add("new" + std::to_string(served), milliseconds(1));
    const uint64_t next = line.queue().Next().value();
    if (next == patient) break;
    line.queue().Serve(next);
    ASSERT_LT(++served, 100) << "more than the patient client's own work was served before it";
  }
  EXPECT_EQ(served, 99);
}

TEST(FairQueueTest, AnUrgentItemOvertakesItsOwnClientsOnly) {
  Line line;
  line.Add("a", milliseconds(10));
  line.Add("b", milliseconds(10));
  line.Add("a", milliseconds(10), Priority::kBulk);
  line.Add("a", milliseconds(10), Priority::kInteractive);
  EXPECT_THAT(line.ServeAll(), ElementsAre(1, 3, 0, 2));
}

TEST(FairQueueTest, WaitingCountsAsPriority) {
  Line line(seconds(5));
  const uint64_t bulk = line.Add("a", milliseconds(1), Priority::kBulk);
  line.now += milliseconds(9'999);
  const uint64_t soon = line.Add("a", milliseconds(1), Priority::kInteractive);
  line.now += milliseconds(2);
  const uint64_t late = line.Add("a", milliseconds(1), Priority::kInteractive);
  EXPECT_THAT(line.ServeAll(), ElementsAre(soon, bulk, late));
}

TEST(FairQueueTest, WithoutAgingPrioritiesAreIgnored) {
  Line line(seconds(0));
  line.Add("a", milliseconds(1), Priority::kBulk);
  line.Add("a", milliseconds(1), Priority::kInteractive);
  EXPECT_THAT(line.ServeAll(), ElementsAre(0, 1));
}

TEST(FairQueueTest, ACompanionIsTheFirstThatFitsOfTheClientWhoseTurnIsNext) {
  Line line;
  line.Add("a", milliseconds(10), Priority::kNormal, 50, 1);
  line.Add("a", milliseconds(10), Priority::kNormal, 60, 1);
  line.Add("b", milliseconds(5), Priority::kNormal, 10, 2);
  line.Add("b", milliseconds(5), Priority::kNormal, 55, 1);
  EXPECT_EQ(line.queue().Companion(1, kAnyCost), 3u);
  EXPECT_EQ(line.queue().Companion(1, 54), 0u);
  EXPECT_EQ(line.queue().Companion(2, kAnyCost), 2u);
  EXPECT_EQ(line.queue().Companion(1, 49), std::nullopt);
  EXPECT_EQ(line.queue().Companion(3, kAnyCost), std::nullopt);
}

TEST(FairQueueTest, ADroppedItemCostsItsClientNothing) {
  Line line;
  line.Add("a", milliseconds(10));
  line.Add("a", milliseconds(10));
  line.Add("b", milliseconds(15));
  line.queue().Drop(0);
  EXPECT_EQ(line.queue().CountOf("a"), 1);
  EXPECT_THAT(line.ServeAll(), ElementsAre(1, 2));
  EXPECT_EQ(line.queue().clients(), 0);
}

TEST(FairQueueTest, WorkBeforeIsWhatWouldBeServedFirst) {
  Line line;
  EXPECT_EQ(line.queue().WorkBefore("a", Priority::kNormal, milliseconds(10)), Duration(0));
  for (int i = 0; i < 10; ++i) line.Add("flood", milliseconds(10));
  line.Add("a", milliseconds(20), Priority::kBulk);
  line.Add("a", milliseconds(20), Priority::kInteractive);
  // Its own urgent one, 20; of the flood as much as it will itself have had by its end, 20 + 10.
  EXPECT_EQ(line.queue().WorkBefore("a", Priority::kNormal, milliseconds(10)), milliseconds(20 + 30));
  EXPECT_EQ(line.queue().WorkBefore("a", Priority::kInteractive, milliseconds(10)), milliseconds(20 + 30));
  // All of its own and all of the flood.
  EXPECT_EQ(line.queue().WorkBefore("a", Priority::kBulk, milliseconds(90)), milliseconds(40 + 100));
  EXPECT_EQ(line.queue().WorkBefore("new", Priority::kNormal, milliseconds(10)), milliseconds(10 + 10));
}

// Invariant (1): clients that always have something waiting, batches of random sizes, items of random work.
// Here cost is work in milliseconds, so that a batch has at most kBatch of it.
TEST(FairQueueTest, ClientsThatAlwaysWaitAreServedEquallyMuch) {
  constexpr int64_t kBatch = 60, kLargest = 40;
  for (uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Line line;
    const int clients = static_cast<int>(2 + random.Below(4));
    std::vector<int64_t> largest;
    for (int c = 0; c < clients; ++c) largest.push_back(1 + random.Below(kLargest));
    std::map<uint64_t, std::pair<int, int64_t>> items;  // client, work
    const auto add = [&](int c) {
      const int64_t work = 1 + random.Below(largest[c]);
      const auto priority = static_cast<Priority>(random.Below(3));
      items[line.Add(std::to_string(c), milliseconds(work), priority, work)] = {c, work};
    };
    for (int c = 0; c < clients; ++c) {
      for (int i = 0; i < 3; ++i) add(c);
    }
    std::vector<int64_t> served(clients, 0);
    for (int batch = 0; batch < 300; ++batch) {
      const int64_t most_items = 1 + random.Below(6);
      int64_t room = kBatch;
      for (int64_t i = 0; i < most_items; ++i) {
        const auto id = i == 0 ? line.queue().Next() : line.queue().Companion(0, room);
        if (!id) break;
        line.queue().Serve(*id);
        const auto [c, work] = items[*id];
        served[c] += work;
        room -= work;
        add(c);
      }
      line.now += milliseconds(random.Below(2000));
      const auto [least, most] = std::minmax_element(served.begin(), served.end());
      ASSERT_LE(*most - *least, kBatch + 2 * kLargest) << "batch " << batch;
    }
  }
}

// Invariant (2): within a client nothing is overtaken by what arrived 2 x aging or more after it.
TEST(FairQueueTest, NothingIsOvertakenByWhatArrivesMuchLater) {
  constexpr milliseconds kAging(50);
  for (uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Line line(kAging);
    std::map<uint64_t, std::pair<std::string, TimePoint>> waiting;
    for (int event = 0; event < 300; ++event) {
      line.now += milliseconds(random.Below(20));
      const std::string client = std::to_string(random.Below(2));
      waiting[line.Add(client, milliseconds(1 + random.Below(9)), static_cast<Priority>(random.Below(3)))] = {
          client, line.now};
      if (waiting.size() < 8) continue;
      const uint64_t id = line.queue().Next().value();
      line.queue().Serve(id);
      const auto [served, arrival] = waiting[id];
      waiting.erase(id);
      for (const auto& [other, place] : waiting) {
        if (place.first != served) continue;
        ASSERT_LT(arrival, place.second + 2 * kAging) << other;
      }
    }
  }
}

}  // namespace
}  // namespace stance
