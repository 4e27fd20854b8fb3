#include "core/training/evaluation_arguments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stance {
namespace {

using ::testing::ElementsAre;

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
