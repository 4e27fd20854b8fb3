#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "core/mesh/io_bytes.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/mesh_check.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

TriangleMesh Parse(std::string_view bytes) {
  absl::StatusOr<TriangleMesh> mesh = ParsePly(bytes);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TriangleMesh{};
}

std::string RejectionOf(std::string_view bytes) {
  const absl::StatusOr<TriangleMesh> mesh = ParsePly(bytes);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(mesh.status().message());
}

Points SquarePoints() { return (Points(4, 3) << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0).finished(); }
Faces SquareFaces() { return (Faces(2, 3) << 0, 1, 2, 0, 2, 3).finished(); }

TEST(ParsePly, ReadsText) {
  const TriangleMesh mesh = Parse(
      "ply\nformat ascii 1.0\ncomment made by hand\nobj_info nothing\nelement vertex 4\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\nproperty list uchar int "
      "vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
  EXPECT_EQ(mesh.positions, SquarePoints());
  EXPECT_EQ(mesh.faces, SquareFaces());
}

TEST(ParsePly, FindsItsPropertiesAmongOthersInAnyOrder) {
  const TriangleMesh mesh = Parse(
      "ply\r\nformat ascii 1.0\r\nelement camera 1\r\nproperty list int float view\r\nproperty float f\r\n"
      "element face 2\r\nproperty list uchar float texcoord\r\nproperty list uint uint vertex_index\r\n"
      "property uchar flags\r\nelement vertex 4\r\nproperty uchar red\r\nproperty double z\r\nproperty "
      "double y\r\n"
      "property double x\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\nproperty float "
      "u\r\n"
      "property float v\r\nend_header\r\n3 9 9 9 1\r\n0 3 0 1 2 7\r\n2 5 5 3 0 2 3 7\r\n"
      "255 0 0 0 0 0 1 0.5 0.25\r\n255 0 0 1 0 0 1 1 0\r\n255 0 1 1 0 0 1 0 0\r\n255 0 1 0 0 0 1 0 0\r\n");
  EXPECT_EQ(mesh.positions, SquarePoints());
  EXPECT_EQ(mesh.faces, SquareFaces());
  EXPECT_EQ(mesh.normals.row(2), Eigen::RowVector3f(0, 0, 1));
  EXPECT_EQ(mesh.texcoords.row(0), Eigen::RowVector2f(0.5f, 0.25f));
}

// One quadrilateral, coordinates as `Real`, indices as `Index`, counts as `Count`.
template <typename Real, typename Count, typename Index>
std::string BinarySquare(std::endian order, const char* real, const char* count, const char* index) {
  std::string bytes =
      "ply\nformat " +
      std::string(order == std::endian::little ? "binary_little_endian" : "binary_big_endian") +
      " 1.0\nelement vertex 4\n";
  for (const char* name : {"x", "y", "z"}) bytes += "property " + std::string(real) + " " + name + "\n";
  bytes +=
      "element face 1\nproperty list " + std::string(count) + " " + index + " vertex_indices\nend_header\n";
  const auto append = [&](auto value) {
    std::string little;
    AppendLittleEndian(value, little);
    if (order == std::endian::big) std::reverse(little.begin(), little.end());
    bytes += little;
  };
  const Points points = SquarePoints();
  for (int64_t k = 0; k < points.size(); ++k) append(static_cast<Real>(points.data()[k]));
  append(static_cast<Count>(4));
  for (int k = 0; k < 4; ++k) append(static_cast<Index>(k));
  return bytes;
}

TEST(ParsePly, ReadsBothByteOrdersAndEveryType) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    for (const std::string& bytes :
         {BinarySquare<float, uint8_t, int32_t>(order, "float", "uchar", "int"),
          BinarySquare<double, int8_t, uint32_t>(order, "float64", "int8", "uint32"),
          BinarySquare<int8_t, uint16_t, uint8_t>(order, "char", "ushort", "uint8"),
          BinarySquare<int16_t, int16_t, int8_t>(order, "short", "int16", "int8"),
          BinarySquare<uint16_t, uint32_t, uint16_t>(order, "uint16", "uint", "ushort"),
          BinarySquare<int32_t, int32_t, int16_t>(order, "int32", "int", "short"),
          BinarySquare<float, uint8_t, float>(order, "float32", "uint8", "float"),
          BinarySquare<double, uint8_t, double>(order, "double", "uchar", "double")}) {
      const TriangleMesh mesh = Parse(bytes);
      EXPECT_EQ(mesh.positions, SquarePoints());
      EXPECT_EQ(mesh.faces, SquareFaces());
    }
  }
}

TEST(ParsePly, CoordinatesBeyondFloatBecomeInfinite) {
  std::string bytes = BinarySquare<double, uint8_t, int32_t>(std::endian::little, "double", "uchar", "int");
  std::string huge;
  AppendLittleEndian(-1e300, huge);
  bytes.replace(bytes.find("end_header\n") + 11, 8, huge);
  const TriangleMesh mesh = Parse(bytes);
  EXPECT_EQ(mesh.positions(0, 0), -std::numeric_limits<float>::infinity());
  EXPECT_FALSE(CheckMesh(mesh).ok());
}

std::string Header(const std::string& lines) { return "ply\nformat ascii 1.0\n" + lines + "end_header\n"; }
const char kVertex1[] = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
const char kFace1[] = "element face 1\nproperty list uchar int vertex_indices\n";

TEST(ParsePly, RefusesMalformedHeadersByLine) {
  EXPECT_EQ(RejectionOf("obj\n"), "PLY: line 1: the first line is not 'ply'");
  EXPECT_EQ(RejectionOf("ply\nformat ascii 1.0\n"), "PLY: line 2: the file ends within the header");
  EXPECT_EQ(RejectionOf("ply\nformat binary 1.0\n"), "PLY: line 2: unknown format 'binary'");
  EXPECT_EQ(RejectionOf("ply\nend_header\n"), "PLY: line 2: the header has no 'format' line");
  EXPECT_EQ(RejectionOf(Header("element vertex x\n")), "PLY: line 3: 'x' is not a count");
  EXPECT_EQ(RejectionOf(Header("element vertex -1\n")), "PLY: line 3: '-1' is not a count");
  EXPECT_EQ(RejectionOf(Header("property float x\n")), "PLY: line 3: a property before the first element");
  EXPECT_EQ(RejectionOf(Header("element vertex 1\nproperty real x\n")), "PLY: line 4: unknown type 'real'");
  EXPECT_EQ(RejectionOf(Header("element face 1\nproperty list float int vertex_indices\n")),
            "PLY: line 4: a list's count is not of an integer type");
  EXPECT_EQ(RejectionOf(Header("elements 3\n")), "PLY: line 3: unknown header line 'elements 3'");
  EXPECT_EQ(RejectionOf(Header("")), "PLY: line 3: there is no element 'vertex'");
  EXPECT_THAT(RejectionOf(Header("element vertex 1\nproperty float x\nproperty float y\n")),
              HasSubstr("lacks one of the properties x, y and z"));
  EXPECT_THAT(RejectionOf(Header(std::string(kVertex1) + "element face 1\nproperty int a\n")),
              HasSubstr("element 'face' has no list 'vertex_indices'"));
  EXPECT_THAT(RejectionOf(Header(std::string(kVertex1) +
                                 "element tristrips 1\nproperty list int int vertex_indices\n")),
              HasSubstr("triangle strips are not supported"));
  EXPECT_THAT(RejectionOf(Header(std::string(kVertex1) + kVertex1)), HasSubstr("a second element 'vertex'"));
}

TEST(ParsePly, RefusesMalformedBodiesByItem) {
  const std::string header = Header(std::string(kVertex1) + kFace1);
  EXPECT_EQ(RejectionOf(header + "0 0 z\n3 0 0 0\n"), "PLY: vertex 0 of 1: a number is missing or malformed");
  EXPECT_EQ(RejectionOf(header + "0 0 0\n3 0 0\n"), "PLY: face 0 of 1: a number is missing or malformed");
  EXPECT_EQ(RejectionOf(header + "0 0 0\n2 0 0\n"), "PLY: face 0 of 1: a face has 2 corners");
  EXPECT_EQ(RejectionOf(header + "0 0 0\n-3 0 0\n"), "PLY: face 0 of 1: a list of -3 numbers");
  EXPECT_EQ(RejectionOf(header + "0 0 0\n3 0 0 4294967295\n"),
            "PLY: face 0 of 1: 4294967295 is not an index");
  std::string fraction = BinarySquare<float, uint8_t, float>(std::endian::little, "float", "uchar", "float");
  fraction[fraction.size() - 1] = 0x3f;  // 3.0 -> a fraction
  EXPECT_THAT(RejectionOf(fraction), HasSubstr("is not an index"));
}

TEST(ParsePly, RefusesCountsThatTheFileCannotHold) {
  for (const char* count : {"50", "4000000000", "9000000000000000000"}) {
    std::string bytes = BinarySquare<float, uint8_t, int32_t>(std::endian::little, "float", "uchar", "int");
    bytes.replace(bytes.find("element face 1") + 13, 1, count);
    EXPECT_THAT(RejectionOf(bytes), HasSubstr("items of element 'face', more than the file holds")) << count;
  }
  EXPECT_THAT(RejectionOf(Header(std::string(kVertex1) + "element nothing 1000000000000\n") + "0 0 0\n"),
              HasSubstr("1000000000000 items of element 'nothing'"));
}

TEST(ParsePly, IndicesOutOfRangeAreForCheckMesh) {
  const TriangleMesh mesh = Parse(Header(std::string(kVertex1) + kFace1) + "0 0 0\n3 0 -1 7\n");
  EXPECT_EQ(mesh.faces, (Faces(1, 3) << 0, -1, 7).finished());
  EXPECT_EQ(CheckMesh(mesh).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace stance
