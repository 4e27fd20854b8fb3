#include "core/training/evaluation_curve_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

CurveRow Row(const Curve& curve, double level, double mean_mm, const std::string& failure = {}) {
  CurveRow row;
  row.curve = curve.name;
  row.level = level;
  row.row.errors.mean_mm = mean_mm;
  row.row.failure = failure;
  return row;
}

TEST(CurvesSvg, HasAPanelPerCurveAndADotPerLevel) {
  std::vector<CurveRow> rows;
  for (const Curve& curve : AllCurves()) {
    for (const double level : curve.levels) rows.push_back(Row(curve, level, 10 + level / 1000));
  }
  const std::string svg = CurvesSvg("Mean vertex error", AllCurves(), rows);
  EXPECT_EQ(svg.substr(0, 4), "<svg");
  EXPECT_EQ(Count(svg, "<polyline"), 4);
  EXPECT_EQ(Count(svg, "<circle"), static_cast<int>(rows.size()));
  EXPECT_THAT(svg, HasSubstr("Mean vertex error"));
  for (const Curve& curve : AllCurves()) EXPECT_THAT(svg, HasSubstr(">" + curve.unit + "<"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(CurvesSvg, AFailedLevelHasNoDot) {
  const Curve curve{Disturbance::kTilt, "tilt", "degrees", {0, 90}};
  EXPECT_EQ(Count(CurvesSvg("t", {curve}, {Row(curve, 0, 5), Row(curve, 90, 0, "no")}), "<circle"), 1);
}

// An axis of one level, and one without any error.
TEST(CurvesSvg, DegenerateAxesStayFinite) {
  const Curve curve{Disturbance::kTilt, "tilt", "degrees", {0}};
  const std::string svg = CurvesSvg("t", {curve}, {Row(curve, 0, 0)});
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

// The largest error lies at the top of the axis when it is a tick itself: y grows downwards.
TEST(CurvesSvg, LargerErrorsLieHigher) {
  const Curve curve{Disturbance::kTilt, "tilt", "degrees", {0, 90}};
  const std::string svg = CurvesSvg("t", {curve}, {Row(curve, 0, 0), Row(curve, 90, 50)});
  EXPECT_THAT(svg, HasSubstr("points='56.0,284.0 396.0,66.0 '"));
}

}  // namespace
}  // namespace stance
