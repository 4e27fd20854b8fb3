#include "core/training/evaluation_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/mesh_io.h"
#include "tests/core/training/evaluation_fixture.h"
#include "tests/core/training/small_data.h"
#include "tests/core/training/stick_character.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

TEST(ParseFileList, ReadsCasesRelativeToTheFolder) {
  const auto cases = ParseFileList(
      "# a comment\n"
      "a.obj b.ply  c.glb\r\n"
      "\n"
      "  /x/a.obj b.obj c.obj 1.25\n"
      "my body.obj\tmy pose.obj\tthe truth.obj",
      "/list");
  ASSERT_TRUE(cases.ok()) << cases.status();
  ASSERT_EQ(cases->size(), 3u);
  EXPECT_EQ((*cases)[0].line, 2);
  EXPECT_EQ((*cases)[0].source, "/list/a.obj");
  EXPECT_EQ((*cases)[0].reference, "/list/b.ply");
  EXPECT_EQ((*cases)[0].truth, "/list/c.glb");
  EXPECT_EQ((*cases)[0].stature, std::nullopt);
  EXPECT_EQ((*cases)[1].line, 4);
  EXPECT_EQ((*cases)[1].source, "/x/a.obj");
  EXPECT_EQ((*cases)[1].stature, 1.25);
  EXPECT_EQ((*cases)[2].source, "/list/my body.obj");
  EXPECT_EQ((*cases)[2].truth, "/list/the truth.obj");
}

TEST(ParseFileList, RefusalsNameTheLine) {
  const struct {
    const char* text;
    const char* said;
  } kBad[] = {
      {"a b c\na b\n", "line 2: 2 fields"},
      {"\n\na b c 1.7 more\n", "line 3: 5 fields"},
      {"a b c tall\n", "line 1: the stature is not a positive number: tall"},
      {"a b c 1.7m\n", "line 1: the stature"},
      {"a b c -1\n", "line 1: the stature"},
      {"a b c 0\n", "line 1: the stature"},
      {"a b c nan\n", "line 1: the stature"},
      {"# nothing\n\n", "no case in its 2 lines"},
      {"", "no case in its 0 lines"},
  };
  for (const auto& bad : kBad) {
    const auto cases = ParseFileList(bad.text, ".");
    EXPECT_EQ(cases.status().code(), absl::StatusCode::kInvalidArgument) << bad.text;
    EXPECT_THAT(std::string(cases.status().message()), HasSubstr(bad.said));
  }
}

class EvaluateFilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(WriteMesh(testing::StickCharacter().mesh, folder_.path() / "body.obj").ok());
    ASSERT_TRUE(WriteMesh(testing::Box(), folder_.path() / "box.obj").ok());
  }

  absl::StatusOr<std::vector<EvaluationRow>> Evaluate(const std::string& list) const {
    const auto cases = ParseFileList(list, folder_.path());
    if (!cases.ok()) return cases.status();
    return EvaluateFiles(*cases, testing::UntrainedPipeline(), {}, 2);
  }

  const testing::TemporaryFolder folder_;
};

TEST_F(EvaluateFilesTest, SourceLeftAsItIsIsZeroWhereItIsTheTruth) {
  const auto rows = Evaluate("body.obj body.obj body.obj\nbody.obj box.obj body.obj 0.85\n");
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_EQ(rows->size(), 4u);
  for (const size_t i : {1u, 3u}) {
    EXPECT_EQ((*rows)[i].method, "source left as it is");
    EXPECT_EQ((*rows)[i].errors.pmd, 0);
    EXPECT_EQ((*rows)[i].errors.chamfer, 0);
  }
  EXPECT_EQ((*rows)[0].method, "skeletal");
  EXPECT_EQ((*rows)[0].pair, "body as body");
  EXPECT_EQ((*rows)[0].failure, "");
  // Transferring a mesh's own pose leaves it unchanged, whatever the networks say.
  EXPECT_NEAR((*rows)[0].errors.mean_mm, 0, 1e-2);
  EXPECT_GT((*rows)[0].seconds, 0);
}

TEST_F(EvaluateFilesTest, ATruthOfAnotherMeshNamesItsLine) {
  const auto rows = Evaluate("body.obj body.obj body.obj\n# comment\nbody.obj body.obj box.obj\n");
  EXPECT_EQ(rows.status().code(), absl::StatusCode::kInvalidArgument);
  const std::string said(rows.status().message());
  EXPECT_THAT(said, HasSubstr("line 3: "));
  EXPECT_THAT(said, HasSubstr("192 vertices"));
  EXPECT_THAT(said, HasSubstr("has 8"));
}

TEST_F(EvaluateFilesTest, AMissingFileNamesItsLine) {
  const auto rows = Evaluate("body.obj absent.obj body.obj\n");
  EXPECT_EQ(rows.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(rows.status().message()), HasSubstr("line 1: "));
  EXPECT_THAT(std::string(rows.status().message()), HasSubstr("absent.obj"));
}

}  // namespace
}  // namespace stance
