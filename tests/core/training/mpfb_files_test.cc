#include "core/training/mpfb_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/core/training/small_data.h"

namespace stance {
namespace {

using testing::TemporaryFolder;

std::filesystem::path Write(const TemporaryFolder& folder, const std::string& text) {
  const std::filesystem::path path = folder.path() / "file";
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

template <typename T>
void ExpectError(const absl::StatusOr<T>& result, absl::StatusCode code, const std::string& fragment) {
  EXPECT_EQ(result.status().code(), code) << result.status();
  EXPECT_NE(std::string(result.status().message()).find(fragment), std::string::npos) << result.status();
}

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
constexpr char kSquare[] =
    "v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 -.5\nv 1 2 3\ng body\nf 1/1 2/2 3/3 4/4\ng cube\nf 5 4 3\n";

TEST(MpfbBase, ReadsGroupsInMetres) {
  const TemporaryFolder folder;
  const auto base = ReadMpfbBase(Write(folder, kSquare));
  ASSERT_TRUE(base.ok()) << base.status();
  EXPECT_EQ(base->vertices.rows(), 5);
  EXPECT_TRUE(base->vertices.row(3).isApprox(Eigen::RowVector3f(0, 1, -0.05f)));
  EXPECT_EQ(base->body_vertices, 4);
  EXPECT_EQ(base->body.rows(), 2);
  EXPECT_EQ(base->groups.at("cube"), (std::vector<int32_t>{2, 3, 4}));
}

TEST(MpfbBase, RejectsMalformedFiles) {
  const TemporaryFolder folder;
  const auto read = [&folder](const std::string& text) { return ReadMpfbBase(Write(folder, text)); };
  ExpectError(ReadMpfbBase(folder.path() / "none.obj"), absl::StatusCode::kNotFound, "none.obj");
  ExpectError(read("v 0 0\n"), kInvalid, ":1:");
  ExpectError(read("v 0 0 0\ng body\nf 1 x 1\n"), kInvalid, ":3:");
  ExpectError(read("v 0 0 0\ng body\nf 1 1\n"), kInvalid, ":3:");
  ExpectError(read("v 0 0 0\ng body\nf 0 1 1\n"), kInvalid, ":3:");
  ExpectError(read("v 0 0 0\ng body\nf 1 1 2\n"), kInvalid, "vertex 1 of 1");
  ExpectError(read("v 0 0 0\n"), kInvalid, "no group 'body'");
  ExpectError(read("v 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\ng body\nf 2 3 4\n"), kInvalid, "not the first 3");
}

TEST(MpfbTarget, ReadsDisplacementsInMetres) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.target.gz";
  testing::WriteGzip(path, "# comment\n\n2 .011 -.018 1\r\n0 0 10 0\n");
  const auto target = ReadMpfbTarget(path, 3);
  ASSERT_TRUE(target.ok()) << target.status();
  EXPECT_TRUE(target->row(2).isApprox(Eigen::RowVector3f(0.0011f, -0.0018f, 0.1f)));
  EXPECT_TRUE(target->row(0).isApprox(Eigen::RowVector3f(0, 1, 0)));
  EXPECT_TRUE(target->row(1).isZero());
}

TEST(MpfbTarget, RejectsMalformedFiles) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.target.gz";
  ExpectError(ReadMpfbTarget(path, 3), absl::StatusCode::kNotFound, "a.target.gz");
  ExpectError(ReadMpfbTarget(Write(folder, "0 1 2 3\n"), 3), absl::StatusCode::kDataLoss, "file");
  for (const std::string line : {"3 0 0 0", "-1 0 0 0", "0 0 0", "x 0 0 0", "0 0 y 0"}) {
    testing::WriteGzip(path, "1 0 0 0\n" + line + "\n");
    ExpectError(ReadMpfbTarget(path, 3), kInvalid, ":2:");
  }
}

std::string Rig(const std::string& head) {
  return R"({"bones": {"mixamorig:Hips": {"head": )" + head + "}}}";
}

TEST(MpfbJoints, RejectsWhatItCantPlace) {
  const TemporaryFolder folder;
  const auto base = ReadMpfbBase(Write(folder, kSquare));
  ASSERT_TRUE(base.ok());
  const auto read = [&](const std::string& text) { return ReadMpfbJoints(Write(folder, text), *base); };
  ExpectError(read("{"), kInvalid, "not JSON");
  ExpectError(read("[]"), kInvalid, "Hips");
  ExpectError(read("{}"), kInvalid, "missing");
  ExpectError(read(Rig(R"({"strategy": "CUBE", "cube_name": "nowhere"})")), kInvalid, "unknown cube");
  ExpectError(read(Rig(R"({"strategy": "MEAN", "vertex_indices": [1, 5]})")), kInvalid, "out of range");
  ExpectError(read(Rig(R"({"strategy": "VERTEX", "vertex_index": "x"})")), kInvalid, "out of range");
  ExpectError(read(Rig(R"({"strategy": "MAGIC"})")), kInvalid, "strategy");
  // A valid pelvis: the next bone is missing.
  ExpectError(read(Rig(R"({"strategy": "VERTEX", "vertex_index": 4})")), kInvalid, "LeftUpLeg");
}

TEST(MpfbJoints, TakesTheStrategiesNotTheDefaultPositions) {
  const TemporaryFolder folder;
  testing::WriteSmallBody(folder.path());
  const auto base = ReadMpfbBase(folder.path() / "3dobjs" / "base.obj");
  ASSERT_TRUE(base.ok()) << base.status();
  const auto joints = ReadMpfbJoints(folder.path() / "rigs" / "standard" / "rig.mixamo.json", *base);
  ASSERT_TRUE(joints.ok()) << joints.status();
  EXPECT_EQ((*joints)[kPelvis].size(), 8u);
  EXPECT_EQ((*joints)[kHead].size(), 2u);
}

TEST(MpfbWeights, FingersJoinTheHandAndThumbsTheWrist) {
  const TemporaryFolder folder;
  const auto weights = ReadMpfbWeights(
      Write(folder,
            R"({"weights": {"mixamorig:LeftHandIndex2": [[0, 0.25]], "mixamorig:LeftHandMiddle1": [[0, 0.5]],
                      "mixamorig:RightHandThumb1": [[1, 0.5], [7, 1]], "mixamorig:Neck": [[1, 1]]}})"),
      2);
  ASSERT_TRUE(weights.ok()) << weights.status();
  EXPECT_FLOAT_EQ((*weights)(0, kLeftHand), 0.75f);
  EXPECT_FLOAT_EQ((*weights)(1, kRightWrist), 0.5f);
  EXPECT_FLOAT_EQ((*weights)(1, kNeck), 1);
  EXPECT_FLOAT_EQ(weights->sum(), 2.25f);
}

TEST(MpfbWeights, RejectsMalformedFiles) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) { return ReadMpfbWeights(Write(folder, text), 2); };
  ExpectError(read("nonsense"), kInvalid, "not JSON");
  ExpectError(read("{}"), kInvalid, "weights");
  ExpectError(read("[1]"), kInvalid, "weights");
  ExpectError(read(R"({"weights": {"mixamorig:Tail": [[0, 1]]}})"), kInvalid, "Tail");
  for (const std::string pair : {"[0]", "[0, -1]", "[-1, 1]", "[0.5, 1]", "[\"a\", 1]", "3"}) {
    ExpectError(read(fmt::format(R"({{"weights": {{"mixamorig:Neck": [{}]}}}})", pair)), kInvalid,
                "bad weight");
  }
}

}  // namespace
}  // namespace stance
