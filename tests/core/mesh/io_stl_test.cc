#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "core/mesh/io_bytes.h"
#include "core/mesh/io_formats.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

TriangleMesh Parse(std::string_view bytes) {
  absl::StatusOr<TriangleMesh> mesh = ParseStl(bytes);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TriangleMesh{};
}

std::string RejectionOf(std::string_view bytes) {
  const absl::StatusOr<TriangleMesh> mesh = ParseStl(bytes);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(mesh.status().message());
}

std::string Facet(std::string_view corners) {
  return "  facet normal 0 0 1\n    outer loop\n" + std::string(corners) + "    endloop\n  endfacet\n";
}

std::string Square(const std::string& name) {
  return "solid " + name + "\n" + Facet("vertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n") +
         Facet("vertex 0 0 0\nvertex 1 1 0\nvertex -0 1 0\n") + "endsolid " + name + "\n";
}

TEST(ParseStl, WeldsEqualCornersInTheOrderOfFirstUse) {
  const TriangleMesh mesh = Parse(Square("square"));
  EXPECT_EQ(mesh.positions, (Points(4, 3) << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0).finished());
  EXPECT_EQ(mesh.faces, (Faces(2, 3) << 0, 1, 2, 0, 2, 3).finished());
}

TEST(ParseStl, MinusZeroEqualsZero) {
  const TriangleMesh mesh = Parse("solid\n" + Facet("vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n") +
                                  Facet("vertex -0.0 0 0\nvertex 0 1 -0\nvertex -1 0 0\n") + "endsolid\n");
  EXPECT_EQ(mesh.vertex_count(), 4);
}

TEST(ParseStl, ReadsTextInAnyCaseAndLayout) {
  const TriangleMesh mesh = Parse(
      "SOLID x\r\nFACET NORMAL 0 0 1 OUTER LOOP VERTEX 0 0 0 VERTEX 1e0 0 0\tVERTEX 0 +1 0 ENDLOOP ENDFACET "
      "ENDSOLID");
  EXPECT_EQ(mesh.faces, (Faces(1, 3) << 0, 1, 2).finished());
}

TEST(ParseStl, SolidsBecomeGroups) {
  const TriangleMesh mesh = Parse(Square("left arm") + Square("right arm"));
  ASSERT_EQ(mesh.groups.size(), 2u);
  EXPECT_EQ(mesh.groups[0].name, "left arm");
  EXPECT_EQ(mesh.groups[1].name, "right arm");
  EXPECT_EQ(mesh.groups[1].first_face, 2);
  EXPECT_EQ(mesh.vertex_count(), 4);
}

TEST(ParseStl, TheSizeTellsBinaryFromText) {
  std::string bytes = SerializeStl(testing::Icosphere(2));
  bytes.replace(0, 11, "solid model");
  const TriangleMesh mesh = Parse(bytes);
  EXPECT_EQ(mesh.face_count(), 320);
  EXPECT_EQ(mesh.vertex_count(), 162);
}

TEST(ParseStl, BinaryLayout) {
  std::string bytes(80, ' ');
  AppendLittleEndian(uint32_t{1}, bytes);
  for (const float value : {0.f, 0.f, 1.f, 1.f, 2.f, 3.f, 4.f, 5.f, 6.f, 7.f, 8.f, 10.f}) {
    AppendLittleEndian(value, bytes);
  }
  bytes += "\x12\x34";
  const TriangleMesh mesh = Parse(bytes);
  EXPECT_EQ(mesh.positions, (Points(3, 3) << 1, 2, 3, 4, 5, 6, 7, 8, 10).finished());
  // Written back, the corners' own normal takes the place of the file's, the rest stays.
  EXPECT_EQ(SerializeStl(mesh).substr(96, 36), bytes.substr(96, 36));
}

TEST(SerializeStl, NormalsPointOutwards) {
  const TriangleMesh mesh = testing::Icosphere(2);
  const std::string bytes = SerializeStl(mesh);
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    Eigen::RowVector3f normal;
    for (int axis = 0; axis < 3; ++axis) {
      normal[axis] = LoadLittleEndian<float>(bytes.data() + 84 + 50 * f + 4 * axis);
    }
    EXPECT_NEAR(normal.norm(), 1.0f, 1e-6f);
    EXPECT_GT(normal.dot(mesh.positions.row(mesh.faces(f, 0))), 0.9f);
  }
}

TEST(ParseStl, RefusesMalformedFiles) {
  EXPECT_EQ(RejectionOf("nonsense"), "STL: 8 bytes are neither a text file nor a binary header");
  const std::string sphere = SerializeStl(testing::Icosphere(0));
  EXPECT_EQ(RejectionOf(sphere.substr(0, sphere.size() - 1)),
            "STL: the header announces 20 facets, which does not fit the file's 1083 bytes");
  EXPECT_EQ(RejectionOf(sphere + "x"),
            "STL: the header announces 20 facets, which does not fit the file's 1085 bytes");
  EXPECT_EQ(RejectionOf("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 q\n"),
            "STL: line 4: 'q' is not a number");
  EXPECT_EQ(RejectionOf("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n"),
            "STL: line 6: 'vertex' expected, 'endloop' found");
  EXPECT_THAT(RejectionOf("solid x\n"), HasSubstr("the file ends where 'facet' is expected"));
  EXPECT_THAT(RejectionOf(Square("a") + "trailing"), HasSubstr("'solid' expected, 'trailing' found"));
}

}  // namespace
}  // namespace stance
