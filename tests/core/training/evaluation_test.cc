#include "core/training/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace stance {
namespace {

using ::testing::HasSubstr;

const Points kTriangle{{0, 0, 0}, {3, 0, 0}, {0, 4, 0}};
const Faces kFace{{0, 1, 2}};

EvaluationRow RowWithMean(const std::string& pair, const std::string& method, double mean_mm, double pmd) {
  EvaluationRow row{.pair = pair, .method = method};
  row.errors.mean_mm = mean_mm;
  row.errors.pmd = pmd;
  return row;
}

TEST(Quantile, InterpolatesBetweenSortedValues) {
  EXPECT_DOUBLE_EQ(Quantile({3, 1, 2}, 0.5), 2);
  EXPECT_DOUBLE_EQ(Quantile({1, 2, 3, 4}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(Quantile({10, 20}, 0.95), 19.5);
  EXPECT_DOUBLE_EQ(Quantile({7}, 1), 7);
  EXPECT_DOUBLE_EQ(Quantile({}, 0.5), 0);
}

TEST(Judge, TheTruthItselfIsZero) {
  const EvaluationRow row =
      Judge("p", {.method = "source left as it is", .positions = kTriangle}, kTriangle, kFace, 1.7);
  EXPECT_EQ(row.pair, "p");
  EXPECT_EQ(row.method, "source left as it is");
  EXPECT_EQ(row.failure, "");
  EXPECT_EQ(row.errors.pmd, 0);
  EXPECT_EQ(row.errors.max_dist, 0);
  EXPECT_EQ(row.errors.elr, 0);
  EXPECT_EQ(row.errors.el, 0);
  EXPECT_EQ(row.errors.chamfer, 0);
  EXPECT_EQ(row.median_mm, 0);
  EXPECT_EQ(row.p95_mm, 0);
}

// A source of 0.85 m counts double: moved by 10 mm, it is 20 mm off, and PMD is 0.02^2.
TEST(Judge, LengthsAreThoseOfTheReferenceStature) {
  Points moved = kTriangle;
  moved.col(2).array() += 0.01f;
  const EvaluationRow row = Judge("p", {.method = "m", .positions = moved}, kTriangle, kFace, 0.85);
  EXPECT_NEAR(row.errors.mean_mm, 20, 1e-4);
  EXPECT_NEAR(row.errors.pmd, 4e-4, 1e-8);
  EXPECT_NEAR(row.median_mm, 20, 1e-4);
  EXPECT_NEAR(row.p95_mm, 20, 1e-4);
}

// Displacements of 0, 0 and 100 mm: the median is 0; the 95 % quantile lies 0.9 of the way to the largest.
TEST(Judge, QuantilesAreOverVertices) {
  Points moved = kTriangle;
  moved(1, 2) = 0.1f;
  const EvaluationRow row = Judge("p", {.method = "m", .positions = moved}, kTriangle, kFace, 1.7);
  EXPECT_NEAR(row.median_mm, 0, 1e-9);
  EXPECT_NEAR(row.p95_mm, 90, 1e-3);
}

TEST(Judge, FailuresAndNanAreSaid) {
  const EvaluationRow failed =
      Judge("p", {.method = "m", .positions = absl::InternalError("out of luck")}, kTriangle, kFace, 1.7);
  EXPECT_THAT(failed.failure, HasSubstr("out of luck"));
  Points broken = kTriangle;
  broken(2, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(Judge("p", {.method = "m", .positions = broken}, kTriangle, kFace, 1.7).failure,
              HasSubstr("not finite"));
}

// PMD 1e-4, 2e-4 and 9e-4: mean 4, median 2, in units of 1e-4 m^2; means 10, 20 and 60 mm: mean 30, worst 60.
TEST(SummaryMarkdown, MeansMediansAndFailures) {
  std::vector<EvaluationRow> rows = {
      RowWithMean("a", "skeletal", 10, 1e-4), RowWithMean("a", "unchanged", 500, 0.3),
      RowWithMean("b", "skeletal", 20, 2e-4), RowWithMean("c", "skeletal", 60, 9e-4),
      EvaluationRow{.pair = "d", .method = "skeletal", .failure = "no"}};
  const std::string table = SummaryMarkdown(rows);
  EXPECT_THAT(table, HasSubstr("| skeletal | 3 (+1 failed) | 4.00 | 2.00 | 30.0 | 0.0 | 0.0 | 60.0 |"));
  EXPECT_THAT(table, HasSubstr("| unchanged | 1 | 3000.00 | 3000.00 | 500.0 |"));
  EXPECT_LT(table.find("skeletal"), table.find("unchanged"));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 4);
}

TEST(SummaryMarkdown, AMethodThatAlwaysFailedHasNoNumbers) {
  const std::string table = SummaryMarkdown({EvaluationRow{.pair = "d", .method = "m", .failure = "no"}});
  EXPECT_THAT(table, HasSubstr("| m | 0 (+1 failed) | | |"));
}

TEST(RowsCsv, OneLinePerRowAfterTheHeaderAllWithTheSameFields) {
  const std::vector<EvaluationRow> rows = {RowWithMean("a", "skeletal", 10, 1e-4),
                                           RowWithMean("b", "skeletal", 20, 2e-4),
                                           EvaluationRow{.pair = "c", .method = "m", .failure = "no luck"}};
  const std::string csv = RowsCsv(rows);
  ASSERT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  size_t begin = 0;
  while (begin < csv.size()) {
    const size_t end = csv.find('\n', begin);
    EXPECT_EQ(
        std::count(csv.begin() + static_cast<int64_t>(begin), csv.begin() + static_cast<int64_t>(end), ','),
        13)
        << csv.substr(begin, end - begin);
    begin = end + 1;
  }
  EXPECT_THAT(csv, HasSubstr("\na,skeletal,0.0001,10,"));
  EXPECT_THAT(csv, HasSubstr("\nc,m,,,,,,,,,,,,no luck\n"));
}

TEST(RowsCsv, FieldsWithCommasAndQuotesAreQuoted) {
  const std::string csv = RowsCsv({EvaluationRow{.pair = "a, b", .method = "say \"x\"", .failure = "no"}});
  EXPECT_THAT(csv, HasSubstr("\"a, b\",\"say \"\"x\"\"\","));
}

}  // namespace
}  // namespace stance
