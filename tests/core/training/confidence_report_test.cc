#include "core/training/confidence_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/base/random.h"
#include "core/network/model_manifest.h"
#include "core/transfer/confidence.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Transfers whose joints are right as often as `truth` of what is stated: of `pairs` of each mix.
std::vector<ConfidenceObservation> DrawnObservations(int pairs, const ConfidenceCalibration& truth) {
  Random random(3);
  std::vector<ConfidenceObservation> observations;
  for (const char* poses : {"moderate", "hard"}) {
    for (int i = 0; i < pairs; ++i) {
      ConfidenceObservation one{.poses = poses, .index = i, .mean_mm = random.Uniform(5, 50)};
      one.shares = Eigen::VectorXf::Constant(kHumanJoints, 1.0f / kHumanJoints);
      for (size_t mesh = 0; mesh < 2; ++mesh) {
        one.confidence[mesh].resize(kHumanJoints);
        one.right[mesh].resize(kHumanJoints);
        for (int j = 0; j < kHumanJoints; ++j) {
          const double p = random.Uniform(0.02, 0.98);
          one.confidence[mesh][j] = static_cast<float>(p);
          one.right[mesh][j] = random.Chance(CalibratedConfidence(p, truth)) ? 1.0f : 0.0f;
        }
      }
      observations.push_back(std::move(one));
    }
  }
  return observations;
}

double HeldOutEce(const ConfidenceReport& report, const ConfidenceCalibration& calibration) {
  std::vector<ConfidenceObservation> held_out;
  for (const ConfidenceObservation& one : report.observations) {
    if (one.index % 2 == 1) held_out.push_back(one);
  }
  return ExpectedCalibrationError(Reliability(Calibrated(JointClaims(held_out), calibration)));
}

TEST(ComposedCalibration, IsOneAfterTheOther) {
  const ConfidenceCalibration first{.scale = 0.6, .bias = 0.3}, second{.scale = 1.9, .bias = -1};
  for (const double p : {0.05, 0.4, 0.99}) {
    EXPECT_NEAR(CalibratedConfidence(p, ComposedCalibration(first, second)),
                CalibratedConfidence(CalibratedConfidence(p, first), second), 1e-9);
  }
  EXPECT_EQ(ComposedCalibration(first, {}), first);
  EXPECT_EQ(ComposedCalibration({}, second), second);
}

TEST(AnalyseConfidence, FindsTheCalibrationThatHoldsForPairsItHasNotSeen) {
  const ConfidenceCalibration truth{.scale = 0.5, .bias = -0.8};
  const ConfidenceReport report = AnalyseConfidence(DrawnObservations(200, truth), {});
  ASSERT_TRUE(report.fitted.has_value());
  EXPECT_NEAR(report.fitted->scale, truth.scale, 0.05);
  EXPECT_NEAR(report.fitted->bias, truth.bias, 0.05);
  EXPECT_GT(HeldOutEce(report, {}), 0.15);
  EXPECT_LT(HeldOutEce(report, *report.fitted), 0.02);
}

// What is held out has no say in the fit.
TEST(AnalyseConfidence, FitsToEvenPairsOnly) {
  const auto observations = DrawnObservations(20, {});
  auto changed = observations;
  for (ConfidenceObservation& one : changed) {
    if (one.index % 2 == 1) one.right.fill(Eigen::VectorXf::Zero(kHumanJoints));
  }
  EXPECT_EQ(AnalyseConfidence(changed, {}).fitted, AnalyseConfidence(observations, {}).fitted);
}

// The printed member, put into a manifest, is the calibration.
TEST(CalibrationJson, IsAManifestsMember) {
  const testing::UntrainedModel model(128, 4, "stance");
  const auto path = model.dir() / "manifest.json";
  std::string text = *ReadFile(path);
  text.insert(text.find('{') + 1, CalibrationJson({.scale = 0.8125, .bias = -1.5e-3}) + ",");
  ASSERT_TRUE(WriteFile(path, text).ok());
  const auto manifest = ReadManifest(model.dir());
  ASSERT_TRUE(manifest.ok()) << manifest.status();
  EXPECT_EQ(manifest->confidence, (ConfidenceCalibration{.scale = 0.8125, .bias = -1.5e-3}));
}

TEST(ConfidenceTables, PrintTheManifestsMemberOnTopOfWhatTheModelHasAlready) {
  ConfidenceReport report = AnalyseConfidence(DrawnObservations(4, {}), {.scale = 2, .bias = 0.5});
  report.fitted = {.scale = 0.5, .bias = 0.25};
  EXPECT_THAT(ConfidenceMarkdown(report), HasSubstr("    \"confidence\": {\"scale\": 1, \"bias\": 0.5}\n"));
  EXPECT_THAT(ConfidenceCsv(report),
              HasSubstr("calibration,,manifest,scale,1\ncalibration,,manifest,bias,0.5\n"));
}

TEST(ConfidenceTables, CoverEachMixAndAllOfThem) {
  auto observations = DrawnObservations(4, {});
  observations.push_back({.poses = "hard", .index = 4, .failure = "INTERNAL: no"});
  const ConfidenceReport report = AnalyseConfidence(observations, {});
  const std::string markdown = ConfidenceMarkdown(report), csv = ConfidenceCsv(report);
  for (const char* row : {"| joints | moderate | 192 |", "| transfers | hard | 4 |", "| joints | all | 384 |",
                          "- hard-4: INTERNAL: no", "| left_knee |", "| 0.000 | 100.0 % |"}) {
    EXPECT_THAT(markdown, HasSubstr(row));
  }
  for (const char* line : {"joints,all,all,count,384\n", "joints,hard,held_out,count,96\n",
                           "transfers,all,held_out_calibrated,count,4\n", "kept,all,0.000,kept,1\n",
                           "joint,moderate,left_knee,count,8\n"}) {
    EXPECT_THAT(csv, HasSubstr(line));
  }
  EXPECT_THAT(markdown + csv, Not(HasSubstr("nan")));
  EXPECT_THAT(ConfidencePlot(report), HasSubstr("class='after'"));
}

// Nothing was transferred, or no calibration fits.
TEST(ConfidenceTables, DoWithoutACalibration) {
  const ConfidenceReport report = AnalyseConfidence({{.poses = "hard", .failure = "INTERNAL: no"}}, {});
  EXPECT_FALSE(report.fitted.has_value());
  EXPECT_THAT(ConfidenceMarkdown(report), HasSubstr("No calibration"));
  EXPECT_THAT(ConfidenceMarkdown(report) + ConfidenceCsv(report), Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace stance
