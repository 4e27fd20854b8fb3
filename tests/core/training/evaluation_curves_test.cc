#include "core/training/evaluation_curves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/training/evaluation_pairs.h"
#include "tests/core/training/evaluation_fixture.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

// The networks are untrained: nothing is said of the errors' sizes.
CurveEvaluationOptions TwoPairs(std::vector<Curve> curves) {
  CurveEvaluationOptions options;
  options.seed = 5;
  options.pairs = 2;
  options.curves = std::move(curves);
  return options;
}

std::vector<CurveRow> Evaluate(const CurveEvaluationOptions& options) {
  return EvaluateCurves(testing::SmallGenerator(), testing::UntrainedPipeline(), options);
}

Curve Tilts() { return {Disturbance::kTilt, "tilt", "degrees", {0, 90}}; }
Curve Counts() { return {Disturbance::kVertices, "vertices", "vertices", {1000, 2000, 4000}, true}; }

CurveRow RowWithMean(double level, double mean_mm, const std::string& failure = {}) {
  CurveRow row;
  row.curve = "tilt";
  row.level = level;
  row.vertices = 100;
  row.row.pair = "moderate-0";
  row.row.errors.mean_mm = mean_mm;
  row.row.errors.pmd = 1e-4 * mean_mm;
  row.row.failure = failure;
  return row;
}

TEST(AllCurves, BeginWithoutDisturbanceAndGrow) {
  ASSERT_EQ(AllCurves().size(), 4u);
  for (const Curve& curve : AllCurves()) {
    EXPECT_TRUE(std::is_sorted(curve.levels.begin(), curve.levels.end()));
    EXPECT_EQ(curve.levels.front() == 0, !curve.logarithmic) << curve.name;
  }
}

TEST(EvaluateCurves, HasARowForEachLevelAndPairInOrder) {
  int last = 0;
  const std::vector<CurveRow> rows =
      EvaluateCurves(testing::SmallGenerator(), testing::UntrainedPipeline(), TwoPairs({Counts(), Tilts()}),
                     [&last](int done) { last = done; });
  EXPECT_EQ(last, 10);
  ASSERT_EQ(rows.size(), 10u);
  const double levels[] = {1000, 1000, 2000, 2000, 4000, 4000, 0, 0, 90, 90};
  const int64_t vertices[] = {1000, 1000, 1800, 1800, 4000, 4000, 1800, 1800, 1800, 1800};
  for (size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].curve, i < 6 ? "vertices" : "tilt");
    EXPECT_EQ(rows[i].level, levels[i]);
    EXPECT_EQ(rows[i].vertices, vertices[i]);
    EXPECT_EQ(rows[i].row.pair, i % 2 == 0 ? "moderate-0" : "moderate-1");
    EXPECT_EQ(rows[i].row.method, "skeletal");
    EXPECT_EQ(rows[i].row.failure, "");
    EXPECT_GT(rows[i].row.errors.mean_mm, 0);
  }
}

// Level 0, and the level nearest to the mesh's own count, are the pairs of EvaluatePairs.
TEST(EvaluateCurves, WithoutDisturbanceTheErrorsAreThoseOfThePairs) {
  PairEvaluationOptions pairs;
  pairs.seed = 5;
  pairs.pairs = 2;
  pairs.poses = {PoseMix::kModerate};
  pairs.parts = false;
  const std::vector<EvaluationRow> expected =
      EvaluatePairs(testing::SmallGenerator(), testing::UntrainedPipeline(), pairs);
  std::vector<Curve> curves = AllCurves();
  for (Curve& curve : curves) curve.levels = {curve.logarithmic ? 2000.0 : 0.0};
  const std::vector<CurveRow> rows = Evaluate(TwoPairs(curves));
  ASSERT_EQ(rows.size(), 8u);
  for (size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].row.errors.mean_mm, expected[i % 2].errors.mean_mm);
    EXPECT_EQ(rows[i].row.pair, expected[i % 2].pair);
  }
}

TEST(EvaluateCurves, DoesNotDependOnTheNumberOfThreads) {
  CurveEvaluationOptions options = TwoPairs({Counts(), Tilts()});
  const std::string one = CurvesCsv(Evaluate(options));
  options.threads = 3;
  EXPECT_EQ(CurvesCsv(Evaluate(options)), one);
}

TEST(EvaluateCurves, ARefusedTransferIsARowsFailure) {
  CurveEvaluationOptions options = TwoPairs({Counts()});
  options.transfer.limits.max_vertices = 3000;
  const std::vector<CurveRow> rows = Evaluate(options);
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_EQ(rows[3].row.failure, "");
  EXPECT_THAT(rows[4].row.failure, HasSubstr("4000"));
  EXPECT_EQ(rows[4].vertices, 4000);
}

TEST(CurvePoints, AreMeansOverThePairsThatWereTransferred) {
  const std::vector<CurvePoint> points = CurvePoints(
      Tilts(), {RowWithMean(0, 10), RowWithMean(0, 20), RowWithMean(0, 0, "no"), RowWithMean(90, 0, "no")});
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].level, 0);
  EXPECT_EQ(points[0].pairs, 2);
  EXPECT_EQ(points[0].failures, 1);
  EXPECT_EQ(points[0].vertices, 100);
  EXPECT_DOUBLE_EQ(points[0].mean_mm, 15);
  EXPECT_DOUBLE_EQ(points[0].worst_mm, 20);
  EXPECT_DOUBLE_EQ(points[0].pmd, 15e-4);
  EXPECT_EQ(points[1].pairs, 0);
  EXPECT_EQ(points[1].failures, 1);
  EXPECT_EQ(points[1].mean_mm, 0);
}

TEST(CurvesMarkdown, HasALinePerLevel) {
  const std::string table = CurvesMarkdown({Tilts()}, {RowWithMean(0, 10), RowWithMean(90, 0, "no")});
  EXPECT_THAT(table, HasSubstr("| tilt | 0 degrees | 1 | 100 | 10.0 | 0.0 | 10.0 | 10.00 | 0.000 |\n"));
  EXPECT_THAT(table, HasSubstr("| tilt | 90 degrees | 0 (+1 failed) | | | | | | |\n"));
}

TEST(CurvesCsv, HasTheNumbersOrTheFailure) {
  EXPECT_EQ(CurvesCsv({RowWithMean(0, 10), RowWithMean(90, 0, "bad, \"worse\"")}),
            "curve,level,pair,vertices,mean_mm,pmd_m2,p95_mm,elr,failure\n"
            "tilt,0,moderate-0,100,10,0.001,0,0,\n"
            "tilt,90,moderate-0,100,,,,,\"bad, \"\"worse\"\"\"\n");
}

}  // namespace
}  // namespace stance
