#include "client/load/log_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/random.h"

namespace stance {
namespace {

// Log-normal, as latencies are: from microseconds to minutes.
std::vector<int64_t> Latencies(uint64_t seed, int count) {
  Random random(seed);
  std::vector<int64_t> values(count);
  for (int64_t& value : values) value = static_cast<int64_t>(std::exp(random.Normal(16.0, 3.0)));
  return values;
}

int64_t Exact(const std::vector<int64_t>& sorted, double q) {
  const auto rank = static_cast<int64_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return sorted[std::max<int64_t>(rank, 1) - 1];
}

TEST(LogHistogramTest, QuantilesAreWithinOneBucketOfTheExactOnes) {
  std::vector<int64_t> values = Latencies(1, 20000);
  LogHistogram histogram;
  for (const int64_t value : values) histogram.Add(value);
  std::sort(values.begin(), values.end());
  for (const double q : {0.0, 0.001, 0.1, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const int64_t exact = Exact(values, q);
    EXPECT_GE(histogram.Quantile(q), exact) << q;
    EXPECT_LE(static_cast<double>(histogram.Quantile(q)), static_cast<double>(exact) * (1 + 1.0 / 128)) << q;
  }
}

TEST(LogHistogramTest, SmallValuesAreExact) {
  for (int64_t value = 0; value < 256; ++value) {
    LogHistogram histogram;
    histogram.Add(value);
    histogram.Add(1000000);
    EXPECT_EQ(histogram.Quantile(0.5), value);
  }
}

TEST(LogHistogramTest, CountMinMaxAndMeanAreExact) {
  LogHistogram histogram;
  for (const int64_t value : {300000, 100000, 200000}) histogram.Add(value);
  EXPECT_EQ(histogram.count(), 3);
  EXPECT_EQ(histogram.min(), 100000);
  EXPECT_EQ(histogram.max(), 300000);
  EXPECT_DOUBLE_EQ(histogram.mean(), 200000.0);
  EXPECT_EQ(histogram.Quantile(1.0), 300000);
}

TEST(LogHistogramTest, MergeEqualsAddingEverythingToOne) {
  const std::vector<int64_t> first = Latencies(2, 5000);
  const std::vector<int64_t> second = Latencies(3, 100);
  LogHistogram all, a, b;
  for (const int64_t value : first) all.Add(value), a.Add(value);
  for (const int64_t value : second) all.Add(value), b.Add(value);
  a.Merge(b);
  EXPECT_EQ(a.count(), all.count());
  EXPECT_EQ(a.min(), all.min());
  EXPECT_EQ(a.max(), all.max());
  EXPECT_NEAR(a.mean(), all.mean(), 1e-9 * all.mean());
  for (double q = 0; q <= 1; q += 0.01) EXPECT_EQ(a.Quantile(q), all.Quantile(q)) << q;
}

TEST(LogHistogramTest, MergingAnEmptyOneChangesNothing) {
  LogHistogram histogram;
  histogram.Add(77);
  histogram.Merge(LogHistogram());
  EXPECT_EQ(histogram.count(), 1);
  EXPECT_EQ(histogram.min(), 77);
  LogHistogram empty;
  empty.Merge(histogram);
  EXPECT_EQ(empty.min(), 77);
}

TEST(LogHistogramTest, ExtremesAreKept) {
  LogHistogram histogram;
  histogram.Add(-5);
  EXPECT_EQ(histogram.min(), 0);
  EXPECT_EQ(histogram.Quantile(1.0), 0);
  histogram.Add(std::numeric_limits<int64_t>::max());
  EXPECT_EQ(histogram.Quantile(1.0), std::numeric_limits<int64_t>::max());
}

TEST(LogHistogramTest, EmptyAnswersZero) {
  const LogHistogram histogram;
  EXPECT_EQ(histogram.Quantile(0.99), 0);
  EXPECT_EQ(histogram.min(), 0);
  EXPECT_EQ(histogram.mean(), 0.0);
}

}  // namespace
}  // namespace stance
