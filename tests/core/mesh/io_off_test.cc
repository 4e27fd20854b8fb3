#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "core/mesh/io_formats.h"
#include "core/mesh/mesh_check.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

TriangleMesh Parse(std::string_view text) {
  absl::StatusOr<TriangleMesh> mesh = ParseOff(text);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TriangleMesh{};
}

std::string RejectionOf(std::string_view text) {
  const absl::StatusOr<TriangleMesh> mesh = ParseOff(text);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(mesh.status().message());
}

TEST(ParseOff, TakesTheCountsWhereverTheyStand) {
  for (const char* header : {"OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF4 1 0\n", "OFF\n4 1\n",
                             "# comment\n\nOFF # here\n#\n4 1 4\n", "OFF\r\n4 1 0\r\n"}) {
    const TriangleMesh mesh =
        Parse(std::string(header) + "0 0 0\n1 0 0 # a comment\n\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    EXPECT_EQ(mesh.positions, (Points(4, 3) << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0).finished()) << header;
    EXPECT_EQ(mesh.faces, (Faces(2, 3) << 0, 1, 2, 0, 2, 3).finished()) << header;
  }
}

TEST(ParseOff, SkipsColours) {
  const TriangleMesh mesh =
      Parse("COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n3 0 1 2 0.5 0.5 0.5\n");
  EXPECT_EQ(mesh.positions, (Points(3, 3) << 0, 0, 0, 1, 0, 0, 0, 1, 0).finished());
  EXPECT_EQ(mesh.faces, (Faces(1, 3) << 0, 1, 2).finished());
  EXPECT_EQ(mesh.normals.rows(), 0);
}

TEST(ParseOff, ReadsNormalsAndTextureCoordinatesAroundColours) {
  const TriangleMesh mesh = Parse(
      "STCNOFF\n3 1 0\n0 0 0  0 0 1  9 9 9 9  0.25 0.5\n1 0 0  0 1 0  9 9 9  0.75 1\n0 1 0  1 0 0  9 9 9 9  "
      "0 1\n"
      "3 0 1 2\n");
  EXPECT_EQ(mesh.normals, (Points(3, 3) << 0, 0, 1, 0, 1, 0, 1, 0, 0).finished());
  EXPECT_EQ(mesh.texcoords, (TexCoords(3, 2) << 0.25f, 0.5f, 0.75f, 1, 0, 1).finished());
  EXPECT_EQ(Parse("NOFF 1 0 0\n1 2 3 0 0 1").normals, (Points(1, 3) << 0, 0, 1).finished());
  EXPECT_EQ(Parse("STOFF 1 0 0\n1 2 3 4 5").texcoords, (TexCoords(1, 2) << 4, 5).finished());
}

TEST(ParseOff, IndicesOutOfRangeAreForCheckMesh) {
  const TriangleMesh mesh = Parse("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n");
  EXPECT_EQ(CheckMesh(mesh).status().message(), "face 0 names vertex 3, but the mesh has 3 vertices");
}

TEST(ParseOff, RefusesMalformedFilesByLine) {
  EXPECT_EQ(RejectionOf("PLY\n"), "OFF: line 1: [ST][C][N]OFF expected, 'PLY' found");
  EXPECT_EQ(RejectionOf("4OFF\n1 0 0\n"), "OFF: line 1: [ST][C][N]OFF expected, '4OFF' found");
  EXPECT_EQ(RejectionOf("OFF BINARY\n"), "OFF: line 1: binary OFF is not supported");
  EXPECT_EQ(RejectionOf("# nothing\n"), "OFF: the file is empty");
  EXPECT_EQ(RejectionOf("OFF\n"), "OFF: line 1: the file ends before the counts");
  EXPECT_EQ(RejectionOf("OFF\nx 1 0\n"), "OFF: line 2: 'x' is not a count");
  EXPECT_EQ(RejectionOf("OFF\n3 -1 0\n"), "OFF: line 2: '-1' is not a count");
  EXPECT_EQ(RejectionOf("OFF\n3 1 0\n0 0 0\n"), "OFF: line 3: the file ends after 1 of 3 vertices");
  EXPECT_EQ(RejectionOf("OFF\n1 1 0\n0 0 0\n"), "OFF: line 3: the file ends after 0 of 1 faces");
  EXPECT_EQ(RejectionOf("OFF\n1 0 0\n0 0\n"), "OFF: line 3: '' is not a number");
  EXPECT_EQ(RejectionOf("NOFF\n1 0 0\n0 0 0 1\n"), "OFF: line 3: '' is not a number");
  EXPECT_EQ(RejectionOf("OFF\n1 1 0\n0 0 0\n2 0 0\n"),
            "OFF: line 4: a face of '2' corners (at least 3 expected)");
  EXPECT_EQ(RejectionOf("OFF\n1 1 0\n0 0 0\n4 0 0 0\n"), "OFF: line 4: 4 corners announced, 3 found");
  EXPECT_EQ(RejectionOf("OFF\n1 1 0\n0 0 0\n3 0 0 1.5\n"), "OFF: line 4: '1.5' is not an index");
  EXPECT_EQ(RejectionOf("OFF\n1 1 0\n0 0 0\n3 0 0 2147483648\n"),
            "OFF: line 4: '2147483648' is not an index");
  EXPECT_THAT(RejectionOf("OFF 9000000000000000000 9000000000000000000 0\n"),
              HasSubstr("the file ends after 0"));
}

}  // namespace
}  // namespace stance
