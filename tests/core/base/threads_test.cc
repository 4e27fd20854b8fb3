#include "core/base/threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <vector>

namespace stance {
namespace {

TEST(CpuQuota, IsAtLeastOne) { EXPECT_GE(CpuQuota(), 1); }

TEST(ParallelFor, CoversEveryIndexOnce) {
  for (const int64_t count : {0, 1, 2, 7, 100, 1001}) {
    for (const int threads : {1, 2, 5}) {
      std::vector<std::atomic<int>> hits(count);
      ParallelFor(count, threads, 3, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) ++hits[i];
      });
      for (const auto& hit : hits) EXPECT_EQ(hit, 1);
    }
  }
}

TEST(ParallelFor, ThrowsOnTheCallersThreadWhatABodyThrows) {
  for (const int threads : {1, 4}) {
    for (const int64_t bad : {0, 99}) {
      std::atomic<int> done = 0;
      EXPECT_THROW(ParallelFor(100, threads, 1,
                               [&](int64_t begin, int64_t end) {
                                 if (begin <= bad && bad < end) throw std::bad_alloc();
                                 done += static_cast<int>(end - begin);
                               }),
                   std::bad_alloc);
      EXPECT_EQ(done, threads == 1 ? 0 : 75) << "the other ranges are run";
    }
  }
}

TEST(ParallelFor, GivesASmallLoopToTheCallerAlone) {
  int calls = 0;  // not atomic: a second thread would be a race that the thread sanitizer sees
  ParallelFor(10, 8, 100, [&](int64_t begin, int64_t end) {
    ++calls;
    EXPECT_EQ(begin, 0);
    EXPECT_EQ(end, 10);
  });
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace stance
