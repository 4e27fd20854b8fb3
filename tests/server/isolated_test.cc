#include "server/isolated.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <new>
#include <stdexcept>

namespace stance {
namespace {

using ::testing::ElementsAre;

using Results = std::vector<absl::StatusOr<int>>;

// Doubles each job. A batch that holds a 13 fails in the way under test, and keeps its company's sizes.
class Doubler {
 public:
  enum class Fault { kThrow, kBadAlloc, kInternal };
  explicit Doubler(Fault fault) : fault_(fault) {}

  Results operator()(std::span<const int> jobs) const {
    sizes_.push_back(jobs.size());
    const bool bad = std::find(jobs.begin(), jobs.end(), 13) != jobs.end();
    if (bad && fault_ == Fault::kThrow) throw std::runtime_error("thirteen");
    if (bad && fault_ == Fault::kBadAlloc) throw std::bad_alloc();
    Results results;
    for (const int job : jobs) {
      if (bad) {
        results.push_back(absl::InternalError("the batch failed"));
      } else if (job < 0) {
        results.push_back(absl::InvalidArgumentError("negative"));
      } else {
        results.push_back(2 * job);
      }
    }
    return results;
  }
  const std::vector<size_t>& sizes() const { return sizes_; }

 private:
  const Fault fault_;
  mutable std::vector<size_t> sizes_;
};

Results RunOn(const Doubler& doubler, const std::vector<int>& jobs) {
  return RunIsolated<int>("doubling", std::span<const int>(jobs),
                          [&](std::span<const int> some) { return doubler(some); });
}

TEST(IsolatedTest, AGoodBatchRunsOnce) {
  const Doubler doubler(Doubler::Fault::kThrow);
  const Results results = RunOn(doubler, {1, 2, 3});
  EXPECT_EQ(*results[0], 2);
  EXPECT_EQ(*results[2], 6);
  EXPECT_THAT(doubler.sizes(), ElementsAre(3));
}

TEST(IsolatedTest, OnlyTheOneAtFaultFailsHoweverTheBatchDoes) {
  const std::pair<Doubler::Fault, absl::StatusCode> faults[] = {
      {Doubler::Fault::kThrow, absl::StatusCode::kInternal},
      {Doubler::Fault::kBadAlloc, absl::StatusCode::kResourceExhausted},
      {Doubler::Fault::kInternal, absl::StatusCode::kInternal}};
  for (const auto& [fault, code] : faults) {
    const Doubler doubler(fault);
    const Results results = RunOn(doubler, {1, 13, 3});
    ASSERT_EQ(results.size(), 3u);
    EXPECT_EQ(results[0].value(), 2);
    EXPECT_EQ(results[1].status().code(), code);
    EXPECT_EQ(results[2].value(), 6);
    EXPECT_THAT(doubler.sizes(), ElementsAre(3, 1, 1, 1));
  }
}

TEST(IsolatedTest, AJobsOwnErrorIsNotTriedAgain) {
  const Doubler doubler(Doubler::Fault::kThrow);
  const Results results = RunOn(doubler, {1, -1});
  EXPECT_EQ(results[1].status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(doubler.sizes(), ElementsAre(2));
}

TEST(IsolatedTest, ASingleJobRunsOnce) {
  const Doubler doubler(Doubler::Fault::kThrow);
  EXPECT_EQ(RunOn(doubler, {13})[0].status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(doubler.sizes(), ElementsAre(1));
}

}  // namespace
}  // namespace stance
