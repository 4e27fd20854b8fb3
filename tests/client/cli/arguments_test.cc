#include "client/cli/arguments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

namespace stance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

absl::StatusOr<Command> Parse(std::vector<const char*> words) {
  words.insert(words.begin(), "stance");
  return ParseArguments(static_cast<int>(words.size()), words.data());
}

template <typename T>
T Parsed(const std::vector<const char*>& words) {
  const absl::StatusOr<Command> command = Parse(words);
  EXPECT_TRUE(command.ok()) << command.status();
  return command.ok() ? std::get<T>(*command) : T();
}

// The text of the usage error, which is one line.
std::string Refused(const std::vector<const char*>& words) {
  const absl::StatusOr<Command> command = Parse(words);
  EXPECT_EQ(command.status().code(), absl::StatusCode::kInvalidArgument);
  const std::string text(command.status().message());
  EXPECT_THAT(text, Not(HasSubstr("\n")));
  EXPECT_FALSE(text.empty());
  return text;
}

TEST(ArgumentsTest, TransferHasTheDocumentedDefaults) {
  unsetenv("STANCE_SERVER");
  const auto arguments = Parsed<TransferArguments>({"transfer", "a.obj", "b.ply", "-o", "c.glb"});
  EXPECT_EQ(arguments.source, "a.obj");
  EXPECT_EQ(arguments.reference, "b.ply");
  EXPECT_THAT(arguments.outputs, ElementsAre("c.glb"));
  EXPECT_EQ(arguments.backend.server, "localhost:50051");
  EXPECT_FALSE(arguments.backend.local);
  EXPECT_EQ(arguments.options.method, std::nullopt);
  EXPECT_EQ(arguments.options.facing, Facing::kReference);
  EXPECT_EQ(arguments.options.ground, Ground::kFree);
  EXPECT_EQ(arguments.min_confidence, 0);
  EXPECT_EQ(arguments.options.smoothing.kind, SmoothingKind::kMetric);
  EXPECT_EQ(arguments.options.smoothing.length, SmoothingOptions().length);
  EXPECT_EQ(arguments.options.source_up, UpAxis::kY);
  EXPECT_EQ(arguments.options.max_influences, 4);
  EXPECT_EQ(arguments.bone_naming, BoneNaming::kSmpl);
  EXPECT_FALSE(arguments.quiet || arguments.json);
}

TEST(ArgumentsTest, EveryTransferOptionIsRead) {
  const auto arguments = Parsed<TransferArguments>({"transfer",
                                                    "a.obj",
                                                    "b.obj",
                                                    "-o",
                                                    "c.obj",
                                                    "--output",
                                                    "d.glb",
                                                    "--local",
                                                    "--model",
                                                    "m",
                                                    "--model",
                                                    "n",
                                                    "--threads",
                                                    "2",
                                                    "--method",
                                                    "skeletal",
                                                    "--facing",
                                                    "source",
                                                    "--ground",
                                                    "source",
                                                    "--smoothing",
                                                    "hopwise",
                                                    "--lambda",
                                                    "7.5",
                                                    "--source-up",
                                                    "z",
                                                    "--reference-up",
                                                    "x",
                                                    "--max-influences",
                                                    "0",
                                                    "--bone-names",
                                                    "mixamo",
                                                    "--twist",
                                                    "inherited",
                                                    "--skeleton",
                                                    "s.json",
                                                    "--weights",
                                                    "w.csv",
                                                    "--view",
                                                    "v.png",
                                                    "--quiet",
                                                    "--json"});
  EXPECT_THAT(arguments.outputs, ElementsAre("c.obj", "d.glb"));
  EXPECT_TRUE(arguments.backend.local);
  EXPECT_EQ(arguments.backend.server, "");
  EXPECT_THAT(arguments.backend.models, ElementsAre("m", "n"));
  EXPECT_EQ(arguments.backend.threads, 2);
  EXPECT_EQ(arguments.options.method, Method::kSkeletal);
  EXPECT_EQ(arguments.options.facing, Facing::kSource);
  EXPECT_EQ(arguments.options.ground, Ground::kSource);
  EXPECT_EQ(arguments.options.smoothing.kind, SmoothingKind::kHopwise);
  EXPECT_EQ(arguments.options.smoothing.lambda, 7.5);
  EXPECT_EQ(arguments.options.source_up, UpAxis::kZ);
  EXPECT_EQ(arguments.options.reference_up, UpAxis::kX);
  EXPECT_EQ(arguments.options.max_influences, 0);
  EXPECT_EQ(arguments.bone_naming, BoneNaming::kMixamo);
  EXPECT_EQ(arguments.options.twist, Twist::kInherited);
  EXPECT_EQ(arguments.skeleton, "s.json");
  EXPECT_EQ(arguments.weights, "w.csv");
  EXPECT_EQ(arguments.view, "v.png");
  EXPECT_TRUE(arguments.quiet && arguments.json);
}

TEST(ArgumentsTest, ConfidenceIsForAMethodThatKnowsIt) {
  const auto arguments = Parsed<TransferArguments>(
      {"transfer", "a.obj", "b.obj", "-o", "c.obj", "--method", "stance", "--min-confidence", "0.5"});
  EXPECT_EQ(arguments.options.method, Method::kStance);
  EXPECT_EQ(arguments.min_confidence, 0.5);
}

TEST(ArgumentsTest, ServerComesFromTheEnvironmentUnlessNamed) {
  setenv("STANCE_SERVER", "from-env:1", 1);
  EXPECT_EQ(Parsed<ServerInfoArguments>({"server-info"}).backend.server, "from-env:1");
  EXPECT_EQ(Parsed<ServerInfoArguments>({"server-info", "--server", "named:2"}).backend.server, "named:2");
  EXPECT_EQ(Parsed<ReloadArguments>({"reload", "--server", "named:2"}).backend.server, "named:2");
  EXPECT_FALSE(Parse({"reload"}).ok()) << "what administers is named";
  unsetenv("STANCE_SERVER");
}

TEST(ArgumentsTest, RigInfoAndRender) {
  const auto rig = Parsed<RigArguments>({"rig", "a.obj", "-o", "r.glb", "-o", "r.json", "--up", "z"});
  EXPECT_THAT(rig.outputs, ElementsAre("r.glb", "r.json"));
  EXPECT_EQ(rig.options.source_up, UpAxis::kZ);
  EXPECT_TRUE(Parsed<InfoArguments>({"info", "a.obj", "--json"}).json);
  const auto render = Parsed<RenderArguments>(
      {"render", "a.obj", "b.obj", "-o", "p.png", "--captions", "one", "two", "--yaw", "90"});
  EXPECT_THAT(render.meshes, ElementsAre("a.obj", "b.obj"));
  EXPECT_THAT(render.captions, ElementsAre("one", "two"));
  EXPECT_EQ(render.yaw, 90.0);
  EXPECT_FALSE(render.pitch.has_value());
}

TEST(ArgumentsTest, HelpAndVersionAreTexts) {
  EXPECT_THAT(Parsed<TextToPrint>({"--help"}).text, HasSubstr("transfer"));
  EXPECT_THAT(Parsed<TextToPrint>({"transfer", "--help"}).text, HasSubstr("--smoothing-length"));
  EXPECT_THAT(Parsed<TextToPrint>({"--version"}).text, HasSubstr("stance 0."));
}

TEST(ArgumentsTest, RefusesWithTheOptionsName) {
  const std::vector<const char*> good = {"transfer", "a.obj", "b.obj", "-o", "c.obj"};
  const auto with = [&](std::vector<const char*> more) {
    more.insert(more.begin(), good.begin(), good.end());
    return Refused(more);
  };
  EXPECT_THAT(with({"--smoothing", "soft"}),
              HasSubstr("--smoothing: \"soft\" is not one of hopwise|metric|none"));
  EXPECT_THAT(with({"--smoothing-length", "0"}), HasSubstr("--smoothing-length: 0 is not in (0, 1]"));
  EXPECT_THAT(with({"--smoothing-length", "nan"}), HasSubstr("--smoothing-length"));
  EXPECT_THAT(with({"--lambda", "3"}), HasSubstr("--lambda: only with --smoothing hopwise"));
  EXPECT_THAT(with({"--smoothing", "hopwise", "--lambda", "10001"}), HasSubstr("--lambda: 10001"));
  EXPECT_THAT(with({"--smoothing", "none", "--smoothing-length", "0.1"}),
              HasSubstr("--smoothing-length: only"));
  EXPECT_THAT(with({"--max-influences", "25"}), HasSubstr("--max-influences: 25"));
  EXPECT_THAT(with({"--max-influences", "-1"}), HasSubstr("--max-influences: -1"));
  EXPECT_THAT(with({"--method", "magic"}), HasSubstr("--method"));
  EXPECT_THAT(with({"--method", "stance", "--twist", "paper"}),
              HasSubstr("--twist: not with --method stance"));
  EXPECT_THAT(with({"--method", "stance", "--lambda", "3"}), HasSubstr("--lambda: not with --method stance"));
  EXPECT_THAT(with({"--facing", "north"}), HasSubstr("--facing: \"north\" is not one of reference|source"));
  EXPECT_THAT(with({"--ground", "moon"}), HasSubstr("--ground: \"moon\" is not one of free|source"));
  EXPECT_THAT(with({"--min-confidence", "1.5"}), HasSubstr("--min-confidence: 1.5 is not in [0, 1]"));
  EXPECT_THAT(with({"--min-confidence", "nan"}), HasSubstr("--min-confidence: nan"));
  EXPECT_THAT(with({"--min-confidence", "0.5", "--method", "skeletal"}),
              HasSubstr("--min-confidence: the method skeletal"));
  EXPECT_THAT(with({"--model", "a", "--model", "b"}), HasSubstr("--model: 2 of them without --local"));
  EXPECT_THAT(with({"--source-up", "w"}), HasSubstr("--source-up"));
  EXPECT_THAT(with({"--reference-up", "Y "}), HasSubstr("--reference-up"));
  EXPECT_THAT(with({"--bone-names", "biped"}), HasSubstr("--bone-names"));
  EXPECT_THAT(with({"--twist", "some"}), HasSubstr("--twist"));
  EXPECT_THAT(with({"--timeout", "0"}), HasSubstr("--timeout: 0"));
  EXPECT_THAT(with({"--local", "--server", "x:1"}), HasSubstr("--server"));
  EXPECT_THAT(with({"--local", "--timeout", "3"}), HasSubstr("--timeout"));
  EXPECT_THAT(with({"--threads", "3"}), HasSubstr("--threads"));
  EXPECT_THAT(with({"--skeleton", "s.txt"}), HasSubstr("--skeleton: s.txt"));
  EXPECT_THAT(with({"--weights", "w.bin"}), HasSubstr("--weights: w.bin"));
  EXPECT_THAT(with({"--view", "v.jpg"}), HasSubstr("--view: v.jpg"));
  EXPECT_THAT(with({"-o", "d.fbx"}), HasSubstr("--output: d.fbx"));
  EXPECT_THAT(with({"-o", "./c.obj"}), HasSubstr("c.obj: named for two outputs"));
  EXPECT_THAT(with({"--unknown"}), HasSubstr("--unknown"));
  EXPECT_THAT(Refused({"transfer", "a.obj", "-o", "c.obj"}), HasSubstr("REFERENCE"));
  EXPECT_THAT(Refused({"transfer", "a.obj", "b.obj"}), HasSubstr("--output"));
  EXPECT_THAT(Refused({"rig", "a.obj", "-o", "r.obj"}), HasSubstr("--output: r.obj"));
  EXPECT_THAT(Refused({"render", "a.obj", "-o", "p.gif"}), HasSubstr("--output: p.gif"));
  EXPECT_THAT(Refused({"render", "a.obj", "-o", "p.png", "--captions", "a", "b"}),
              HasSubstr("--captions: 2"));
  Refused({});
  Refused({"dance"});
}

TEST(ArgumentsTest, AnimateTakesTheFormatOfTheSource) {
  const auto animate =
      Parsed<AnimateArguments>({"animate", "hero.GLB", "a.obj", "poses", "-o", "out", "--facing", "source"});
  EXPECT_EQ(animate.source, "hero.GLB");
  EXPECT_THAT(animate.references, ElementsAre("a.obj", "poses"));
  EXPECT_EQ(animate.output, "out");
  EXPECT_EQ(animate.format, "glb");
  EXPECT_EQ(animate.options.facing, Facing::kSource);
  EXPECT_EQ(Parsed<AnimateArguments>({"animate", "a.obj", "b.obj", "-o", "out", "--format", "ply"}).format,
            "ply");
  EXPECT_THAT(Refused({"animate", "a.obj", "b.obj", "-o", "out", "--format", "fbx"}), HasSubstr("--format"));
  EXPECT_THAT(Refused({"animate", "a.obj", "b.obj"}), HasSubstr("--output"));
  EXPECT_THAT(Refused({"animate", "a.obj", "-o", "out"}), HasSubstr("REFERENCE"));
}

}  // namespace
}  // namespace stance
