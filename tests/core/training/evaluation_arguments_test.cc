#include "core/training/evaluation_arguments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stance {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Outcome {
  std::optional<int> exit_code;
  EvaluationArguments arguments;
};

Outcome Parse(std::vector<const char*> words) {
  words.insert(words.begin(), "/somewhere/bin/stance-eval");
  Outcome outcome;
  outcome.exit_code =
      ParseEvaluationArguments(static_cast<int>(words.size()), words.data(), outcome.arguments);
  return outcome;
}

TEST(ParseEvaluationArguments, Pairs) {
  const auto [exit_code, arguments] = Parse({"pairs",     "--model",     "m",
                                             "--data",    "p",           "--pairs",
                                             "7",         "--seed",      "9",
                                             "--poses",   "hard",        "--twist",
                                             "inherited", "--smoothing", "hopwise",
                                             "--lambda",  "5",           "--no-global-rotation",
                                             "--out",     "o",           "--rigged-share",
                                             "0.5"});
  ASSERT_EQ(exit_code, std::nullopt);
  EXPECT_EQ(arguments.command, EvaluationCommand::kPairs);
  EXPECT_EQ(arguments.command_line.substr(0, 25), "stance-eval pairs --model");
  EXPECT_EQ(arguments.model, "m");
  EXPECT_EQ(arguments.data, "p");
  EXPECT_EQ(arguments.out, "o");
  EXPECT_EQ(arguments.pairs, 7);
  EXPECT_EQ(arguments.seed, 9u);
  EXPECT_THAT(arguments.poses, ElementsAre(PoseMix::kHard));
  EXPECT_EQ(arguments.transfer.twist, Twist::kInherited);
  EXPECT_EQ(arguments.transfer.smoothing.kind, SmoothingKind::kHopwise);
  EXPECT_EQ(arguments.transfer.smoothing.lambda, 5);
  EXPECT_FALSE(arguments.characters.global_rotation);
  EXPECT_EQ(arguments.characters.rigged_share, 0.5);
  EXPECT_EQ(arguments.characters.split, Split::kTest);
  EXPECT_GE(arguments.threads, 1);
}

TEST(ParseEvaluationArguments, DefaultsAreThoseOfThePipeline) {
  const auto [exit_code, arguments] = Parse({"stages", "--model", "m"});
  ASSERT_EQ(exit_code, std::nullopt);
  EXPECT_EQ(arguments.command, EvaluationCommand::kStages);
  EXPECT_THAT(arguments.poses, ElementsAre(PoseMix::kModerate, PoseMix::kHard));
  EXPECT_EQ(arguments.transfer.smoothing.kind, TransferOptions().smoothing.kind);
  EXPECT_EQ(arguments.transfer.twist, Twist::kPaper);
  EXPECT_TRUE(arguments.characters.global_rotation);
  EXPECT_EQ(arguments.characters.rigged_share, 0);
}

TEST(ParseEvaluationArguments, CurvesHaveDefaultsOfTheirOwn) {
  const auto [exit_code, arguments] = Parse({"curves", "--model", "m"});
  ASSERT_EQ(exit_code, std::nullopt);
  EXPECT_EQ(arguments.command, EvaluationCommand::kCurves);
  EXPECT_EQ(arguments.pairs, 20);
  EXPECT_EQ(arguments.transfer.method, std::nullopt);  // the model's own
  EXPECT_EQ(arguments.curves.size(), 4u);
  EXPECT_EQ(Parse({"pairs", "--model", "m"}).arguments.pairs, 100);
}

TEST(ParseEvaluationArguments, CurvesAreChosenByName) {
  const auto [exit_code, arguments] =
      Parse({"curves", "--model", "m",      "--method", "skeletal",  "--pairs", "3",
             "--data", "p",       "--seed", "4",        "--threads", "2",       "--out",
             "o",      "--curve", "tilt",   "--curve",  "noise",     "--curve", "tilt"});
  ASSERT_EQ(exit_code, std::nullopt);
  EXPECT_EQ(arguments.pairs, 3);
  EXPECT_EQ(arguments.transfer.method, Method::kSkeletal);
  EXPECT_EQ(arguments.data, "p");
  EXPECT_EQ(arguments.seed, 4u);
  EXPECT_EQ(arguments.threads, 2);
  EXPECT_EQ(arguments.out, "o");
  ASSERT_EQ(arguments.curves.size(), 2u);
  EXPECT_EQ(arguments.curves[0].name, "noise");
  EXPECT_EQ(arguments.curves[1].name, "tilt");
}

TEST(ParseEvaluationArguments, AnUnknownCurveIsNamedWithItsOption) {
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(Parse({"curves", "--model", "m", "--curve", "odd"}).exit_code, 2);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), AllOf(HasSubstr("--curve"), HasSubstr("odd")));
}

TEST(ParseEvaluationArguments, FilesAndRender) {
  const Outcome files = Parse({"files", "list.txt", "--model", "m", "--source-up", "z"});
  ASSERT_EQ(files.exit_code, std::nullopt);
  EXPECT_EQ(files.arguments.command, EvaluationCommand::kFiles);
  EXPECT_EQ(files.arguments.list, "list.txt");
  EXPECT_EQ(files.arguments.transfer.source_up, UpAxis::kZ);
  EXPECT_EQ(files.arguments.transfer.reference_up, UpAxis::kY);

  const Outcome render =
      Parse({"render", "--model", "m", "--out", "o", "--files", "a.obj", "b.obj", "--skeletons"});
  ASSERT_EQ(render.exit_code, std::nullopt);
  EXPECT_EQ(render.arguments.command, EvaluationCommand::kRender);
  EXPECT_THAT(render.arguments.files, ElementsAre("a.obj", "b.obj"));
  EXPECT_TRUE(render.arguments.skeletons);

  const Outcome chosen = Parse({"render", "--model", "m", "--out", "o", "--index", "3", "5"});
  EXPECT_THAT(chosen.arguments.indices, ElementsAre(3, 5));
}

TEST(ParseEvaluationArguments, Bones) {
  const auto [exit_code, arguments] =
      Parse({"bones", "--model", "m", "--data", "p", "--identities", "3", "--poses-each", "4"});
  ASSERT_EQ(exit_code, std::nullopt);
  EXPECT_EQ(arguments.command, EvaluationCommand::kBones);
  EXPECT_EQ(arguments.identities, 3);
  EXPECT_EQ(arguments.poses_each, 4);
  EXPECT_EQ(arguments.characters.split, Split::kTest);
}

TEST(ParseEvaluationArguments, Confidence) {
  const auto [exit_code, arguments] =
      Parse({"confidence", "--model", "m", "--method", "stance", "--pairs", "2", "--rigged-share", "0.25"});
  ASSERT_EQ(exit_code, std::nullopt);
  EXPECT_EQ(arguments.command, EvaluationCommand::kConfidence);
  EXPECT_EQ(arguments.pairs, 2);
  EXPECT_EQ(arguments.characters.rigged_share, 0.25);
}

// The error's text of a command line that means nothing.
std::string ErrorOf(std::vector<const char*> words) {
  ::testing::internal::CaptureStderr();
  const std::optional<int> exit_code = Parse(std::move(words)).exit_code;
  const std::string text = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(exit_code, 2) << text;
  return text;
}

TEST(ParseEvaluationArguments, ErrorsNameOptionAndValue) {
  const auto names = [](const char* option, const char* value) {
    return ::testing::AllOf(::testing::HasSubstr(option), ::testing::HasSubstr(value));
  };
  EXPECT_THAT(ErrorOf({"bones", "--model", "m", "--identities", "0"}), names("--identities", "0"));
  EXPECT_THAT(ErrorOf({"bones", "--model", "m", "--poses-each", "1"}), names("--poses-each", "1"));
  EXPECT_THAT(ErrorOf({"bones", "--model", "m", "--pairs", "7"}), names("--pairs", "7"));
  EXPECT_THAT(ErrorOf({"confidence", "--model", "m", "--method", "skeletal"}),
              names("--method", "'skeletal'"));
  EXPECT_THAT(ErrorOf({"confidence", "--model", "m", "--method", "stance", "--pairs", "1"}),
              names("--pairs", "1"));
  EXPECT_THAT(ErrorOf({"confidence", "--model", "m", "--method", "stance", "--rigged-share", "2"}),
              names("--rigged-share", "2"));
}

TEST(ParseEvaluationArguments, HelpEndsWell) { EXPECT_EQ(Parse({"--help"}).exit_code, 0); }

TEST(ParseEvaluationArguments, WhatMeansNothingEndsWithTwo) {
  EXPECT_EQ(Parse({}).exit_code, 2);
  EXPECT_EQ(Parse({"pears"}).exit_code, 2);
  EXPECT_EQ(Parse({"pairs"}).exit_code, 2);  // no model
  EXPECT_EQ(Parse({"pairs", "--model", "m", "--poses", "odd"}).exit_code, 2);
  EXPECT_EQ(Parse({"pairs", "--model", "m", "--pairs", "0"}).exit_code, 2);
  EXPECT_EQ(Parse({"pairs", "--model", "m", "--method", "magic"}).exit_code, 2);
  EXPECT_EQ(Parse({"render", "--model", "m"}).exit_code, 2);  // no folder
  EXPECT_EQ(Parse({"render", "--model", "m", "--out", "o", "--files", "a", "b", "c"}).exit_code, 2);
}

}  // namespace
}  // namespace stance
