#include "client/load/load_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace stance {
namespace {

TEST(LoadReportTest, LatencyCountsFromThePlannedTime) {
  LoadReport report;
  report.Record(1.0, 3.0, 3.5, "OK");
  EXPECT_EQ(report.latency.max(), 2'500'000'000);
  EXPECT_EQ(report.send_delay.max(), 2'000'000'000);
}

TEST(LoadReportTest, ErrorsAreCountedByCodeAndHaveNoLatency) {
  LoadReport report;
  report.seconds = 2.0;
  report.Record(0.0, 0.0, 1.0, "OK");
  report.Record(0.0, 0.0, 9.0, "UNAVAILABLE");
  report.Record(0.0, 0.0, 9.0, "UNAVAILABLE");
  report.Record(0.0, 0.0, 9.0, "DEADLINE_EXCEEDED");
  EXPECT_EQ(report.succeeded(), 1);
  EXPECT_EQ(report.latency.max(), 1'000'000'000);
  EXPECT_EQ(report.errors.at("UNAVAILABLE"), 2);
  EXPECT_EQ(report.errors.at("DEADLINE_EXCEEDED"), 1);
  EXPECT_DOUBLE_EQ(report.throughput(), 0.5);
}

TEST(LoadReportTest, JsonIsInMilliseconds) {
  LoadReport report;
  report.mode = "open";
  report.rate = 5;
  report.planned = 3, report.sent = 2, report.unsent = 1;
  report.Record(0.0, 0.0, 0.25, "OK");
  report.Record(0.0, 0.0, 1.0, "ABORTED");
  const auto json = nlohmann::json::parse(LoadReportJson(report));
  EXPECT_EQ(json["rate"], 5);
  EXPECT_EQ(json["unsent"], 1);
  EXPECT_EQ(json["ok"], 1);
  EXPECT_DOUBLE_EQ(json["latency_ms"]["max"].get<double>(), 250.0);
  EXPECT_EQ(json["errors"], nlohmann::json({{"ABORTED", 1}}));
}

}  // namespace
}  // namespace stance
