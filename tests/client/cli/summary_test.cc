#include "client/cli/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace stance {
namespace {

using ::testing::HasSubstr;

Summary Example() {
  Summary summary;
  summary.vertices = 12;
  summary.faces = 20;
  summary.outputs = {"a.obj", "b \"c\".glb"};
  summary.warnings = {"source: odd"};
  summary.model = "m";
  summary.phases.total = 0.25;
  summary.service.queue = 0.125;
  summary.wall_seconds = 0.5;
  return summary;
}

TEST(SummaryTest, TextHasALinePerWarningAndPerFile) {
  const std::string text = SummaryText(Example(), false);
  EXPECT_THAT(text, HasSubstr("warning: source: odd\n"));
  EXPECT_THAT(text, HasSubstr("12 vertices, 20 faces, model m: 250 ms, 500 ms with files\n"));
  EXPECT_THAT(text, HasSubstr("wrote a.obj\n"));
}

TEST(SummaryTest, ConfidenceIsSaidWhereItIsKnown) {
  Summary summary = Example();
  EXPECT_THAT(SummaryText(summary, false), ::testing::Not(HasSubstr("confidence")));
  EXPECT_FALSE(nlohmann::json::parse(SummaryText(summary, true)).contains("confidence"));
  summary.confidence = 0.75f;
  EXPECT_THAT(SummaryText(summary, false), HasSubstr("\nconfidence 0.75\n"));
  EXPECT_EQ(nlohmann::json::parse(SummaryText(summary, true))["confidence"], 0.75);
}

TEST(SummaryTest, JsonHoldsEveryFactAndNoRequestIdWithoutAServer) {
  Summary summary = Example();
  const auto json = nlohmann::json::parse(SummaryText(summary, true));
  EXPECT_EQ(json["vertices"], 12);
  EXPECT_EQ(json["outputs"], nlohmann::json(summary.outputs));
  EXPECT_EQ(json["warnings"], nlohmann::json(summary.warnings));
  EXPECT_EQ(json["seconds"]["total"], 0.25);
  EXPECT_EQ(json["seconds"]["queue"], 0.125);
  EXPECT_EQ(json["seconds"]["wall"], 0.5);
  EXPECT_FALSE(json.contains("request_id"));
  summary.request_id = "id";
  EXPECT_EQ(nlohmann::json::parse(SummaryText(summary, true))["request_id"], "id");
}

}  // namespace
}  // namespace stance
