#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>

#include "core/mesh/io_formats.h"
#include "core/mesh/mesh_check.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

TriangleMesh Parse(std::string_view text) {
  absl::StatusOr<TriangleMesh> mesh = ParseObj(text);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TriangleMesh{};
}

std::string RejectionOf(std::string_view text) {
  const absl::StatusOr<TriangleMesh> mesh = ParseObj(text);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(mesh.status().message());
}

constexpr std::string_view kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string Square(std::string_view rest) { return std::string(kSquare) + std::string(rest); }

TEST(ParseObj, TriangulatesPolygonsAsFans) {
  const TriangleMesh mesh = Parse("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 2 3 4 5 1\n");
  Faces expected(3, 3);
  expected << 1, 2, 3, 1, 3, 4, 1, 4, 0;
  EXPECT_EQ(mesh.faces, expected);
}

TEST(ParseObj, TakesEveryCornerForm) {
  const std::string attributes = Square("vt 0 0\nvt 0.5 1\nvn 0 0 1\n");
  for (const char* face :
       {"f 1 2 3", "f 1/1 2/2 3/1", "f 1//1 2//1 3//1", "f 1/1/1 2/2/1 3/1/1", "f 1/ 2// 3//1", "f -4 -3 -2",
        "f -4/-2/-1 -3/-1/-1 -2/-2/-1", "\tf  +1\t2 3  # comment"}) {
    const TriangleMesh mesh = Parse(attributes + face);
    EXPECT_EQ(mesh.faces, (Faces(1, 3) << 0, 1, 2).finished()) << face;
  }
}

TEST(ParseObj, NegativeIndicesCountBackFromTheirLine) {
  const TriangleMesh mesh = Parse(Square("f -4 -3 -2\nv 5 5 5\nf -5 -2 -1\n"));
  EXPECT_EQ(mesh.faces, (Faces(2, 3) << 0, 1, 2, 0, 3, 4).finished());
}

TEST(ParseObj, AVertexTakesTheAttributesOfItsFirstCorner) {
  const TriangleMesh mesh =
      Parse(Square("vt 0.1 0.2\nvt 0.3 0.4\nvt 0.5 0.6\nvn 0 0 1\nvn 1 0 0\n"
                   "f 1/1/1 2/2/1 3/3/2\nf 1/3/2 3/1/1 4\n"));
  EXPECT_EQ(mesh.vertex_count(), 4);
  const TexCoords expected = (TexCoords(4, 2) << 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0, 0).finished();
  EXPECT_EQ(mesh.texcoords, expected);
  EXPECT_EQ(mesh.normals, (Points(4, 3) << 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 0).finished());
}

TEST(ParseObj, AttributesThatNoFaceUsesAreDropped) {
  const TriangleMesh mesh = Parse(Square("vt 0.1 0.2\nvn 0 0 1\nf 1 2 3\n"));
  EXPECT_EQ(mesh.texcoords.rows(), 0);
  EXPECT_EQ(mesh.normals.rows(), 0);
}

TEST(ParseObj, GroupsAreRunsOfFaces) {
  const TriangleMesh mesh = Parse(Square(
      "f 1 2 3\no empty\ng left hand\nf 1 2 3 4\ng\nf 1 2 4\no body\nf 2 3 4\ng left hand\nf 1 3 4\n"));
  ASSERT_EQ(mesh.groups.size(), 5u);
  const std::string names[] = {"", "left hand", "", "body", "left hand"};
  const int64_t counts[] = {1, 2, 1, 1, 1};
  int64_t first = 0;
  for (int g = 0; g < 5; ++g) {
    EXPECT_EQ(mesh.groups[g].name, names[g]);
    EXPECT_EQ(mesh.groups[g].first_face, first);
    EXPECT_EQ(mesh.groups[g].face_count, counts[g]);
    first += counts[g];
  }
}

TEST(ParseObj, LinesEndInEveryWayAndGoOnAfterABackslash) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char* line : {"# a comment", "mtllib a.mtl", "v 0 0 0", "v 1 \\", "0 0", "v 0 1 0 1.0",
                             "s off", "usemtl skin", "f 1 2\\", "3", ""}) {
      text += std::string(line) + end;
    }
    const TriangleMesh mesh = Parse(text);
    EXPECT_EQ(mesh.positions, (Points(3, 3) << 0, 0, 0, 1, 0, 0, 0, 1, 0).finished());
    EXPECT_EQ(mesh.faces, (Faces(1, 3) << 0, 1, 2).finished());
  }
}

TEST(ParseObj, TakesEveryNumberForm) {
  const TriangleMesh mesh = Parse("v +1.5 -2e-3 .25\nv 1E2 7. 1e-60\n");
  EXPECT_EQ(mesh.positions, (Points(2, 3) << 1.5f, -2e-3f, 0.25f, 100, 7, 0).finished());
  const TriangleMesh huge = Parse("v 1e39 -1e400 nan\nv 1e-400 -0 3.4e38\n");
  EXPECT_TRUE(std::isinf(huge.positions(0, 0)));
  EXPECT_TRUE(std::isinf(huge.positions(0, 1)) && huge.positions(0, 1) < 0);
  EXPECT_TRUE(std::isnan(huge.positions(0, 2)));
  EXPECT_EQ(huge.positions(1, 0), 0.0f);
}

TEST(ParseObj, VertexColoursAreSkipped) {
  EXPECT_EQ(Parse("v 1 2 3 0.5 0.5 0.5\n").positions, (Points(1, 3) << 1, 2, 3).finished());
}

TEST(ParseObj, IndicesBeyondTheVerticesAreForCheckMesh) {
  const TriangleMesh mesh = Parse(Square("f 1 2 3\nf 1 2 9\n"));
  EXPECT_EQ(CheckMesh(mesh).status().message(), "face 1 names vertex 8, but the mesh has 4 vertices");
}

TEST(ParseObj, VerticesMayFollowTheFacesThatUseThem) {
  const TriangleMesh mesh = Parse("vt 0 1\nf 1/1 2/1 3/1\n" + std::string(kSquare));
  EXPECT_TRUE(CheckMesh(mesh).ok());
  EXPECT_EQ(mesh.face_count(), 1);
}

TEST(ParseObj, RefusesMalformedLinesByNumber) {
  EXPECT_EQ(RejectionOf("v 0 0 0\nv 1 x 0\n"), "OBJ: line 2: 'x' is not a number");
  EXPECT_EQ(RejectionOf("v 0 0 0\n\nv 1 2\n"), "OBJ: line 3: 3 numbers expected, 2 found");
  EXPECT_EQ(RejectionOf("v 1,5 0 0\n"), "OBJ: line 1: '1,5' is not a number");
  EXPECT_EQ(RejectionOf(Square("f 1 2\n")), "OBJ: line 5: a face has 2 corners");
  EXPECT_EQ(RejectionOf(Square("f 1 2 b\n")), "OBJ: line 5: 'b' is not an index");
  EXPECT_EQ(RejectionOf(Square("f 1 2 0\n")), "OBJ: line 5: index 0 is out of range (4 defined so far)");
  EXPECT_EQ(RejectionOf(Square("f 1 2 -5\n")), "OBJ: line 5: index -5 is out of range (4 defined so far)");
  EXPECT_THAT(RejectionOf(Square("f 1 2 3000000000\n")), HasSubstr("index 3000000000 is out of range"));
  EXPECT_THAT(RejectionOf(Square("f 1 2 99999999999999999999\n")), HasSubstr("is not an index"));
  EXPECT_EQ(RejectionOf(Square("f 1/1/1/1 2 3\n")), "OBJ: line 5: a corner has more than three indices");
  EXPECT_THAT(RejectionOf(Square("vt 0 0\nf 1/1 2/2 3/1\n")),
              HasSubstr("vertex 2 uses texture coordinate 2, but only 1 are defined"));
  EXPECT_THAT(RejectionOf(Square("f 1//7 2//7 3//7\n")),
              HasSubstr("vertex 1 uses normal 7, but only 0 are defined"));
}

TEST(ParseObj, RefusesBytesWithoutVertices) {
  EXPECT_EQ(RejectionOf("solid cube\n"), "OBJ: there is no 'v' line");
}

TEST(ParseObj, MessagesHoldOnlyPrintableText) {
  EXPECT_EQ(RejectionOf("v 0 0 \xff\x01\n"), "OBJ: line 1: '\?\?' is not a number");
  const std::string text = RejectionOf("v " + std::string(5000, 'x'));
  EXPECT_LT(text.size(), 200u);
}

}  // namespace
}  // namespace stance
