#include "proto/wire/mesh_wire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

void ExpectInvalid(const absl::Status& status, const std::string& start) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), StartsWith(start));
}

TEST(MeshWireTest, ArraysRoundTripBitByBit) {
  const TriangleMesh mesh = testing::WithAttributes(testing::Icosphere(2));
  v1::Mesh wire;
  MeshToArrays(mesh, wire.mutable_arrays());
  const absl::StatusOr<TriangleMesh> read = MeshFromWire(wire);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->positions, mesh.positions);
  EXPECT_EQ(read->faces, mesh.faces);
  EXPECT_EQ(read->normals, mesh.normals);
  EXPECT_EQ(read->texcoords, mesh.texcoords);
}

TEST(MeshWireTest, ArraysAreLittleEndianRows) {
  TriangleMesh mesh;
  mesh.positions.resize(1, 3);
  mesh.positions << 1.0f, -2.0f, 0.0f;
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 258;
  v1::MeshArrays arrays;
  MeshToArrays(mesh, &arrays);
  EXPECT_EQ(arrays.positions(), std::string("\0\0\x80\x3f\0\0\0\xc0\0\0\0\0", 12));
  EXPECT_EQ(arrays.indices(), std::string("\0\0\0\0\1\0\0\0\2\1\0\0", 12));
}

TEST(MeshWireTest, FilesOfEveryFormatAreRead) {
  const TriangleMesh mesh = testing::Box();
  for (const MeshFormat format :
       {MeshFormat::kObj, MeshFormat::kPly, MeshFormat::kOff, MeshFormat::kStl, MeshFormat::kGlb}) {
    const absl::StatusOr<std::string> bytes = SerializeMesh(mesh, format);
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    v1::Mesh wire;
    wire.mutable_file()->set_content(*bytes);
    wire.mutable_file()->set_format(MeshFormatToWire(format));
    const absl::StatusOr<TriangleMesh> read = MeshFromWire(wire);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->vertex_count(), 8);
    EXPECT_EQ(read->face_count(), 12);
  }
}

TEST(MeshWireTest, RefusesEachWithItsField) {
  v1::Mesh wire;
  ExpectInvalid(MeshFromWire(wire).status(), "data: ");
  wire.mutable_file()->set_content("v 0 0 0");
  ExpectInvalid(MeshFromWire(wire).status(), "file.format: ");
  wire.mutable_file()->set_format(static_cast<v1::MeshFormat>(77));
  ExpectInvalid(MeshFromWire(wire).status(), "file.format: unknown format 77");
  wire.mutable_file()->set_format(v1::MESH_FORMAT_GLB);
  ExpectInvalid(MeshFromWire(wire).status(), "file.content: ");

  MeshToArrays(testing::WithAttributes(testing::Box()), wire.mutable_arrays());
  v1::Mesh bad = wire;
  bad.mutable_arrays()->mutable_positions()->pop_back();
  ExpectInvalid(MeshFromWire(bad).status(), "arrays.positions: 95 bytes");
  bad = wire;
  bad.mutable_arrays()->mutable_indices()->append("x");
  ExpectInvalid(MeshFromWire(bad).status(), "arrays.indices: 145 bytes");
  bad = wire;
  bad.mutable_arrays()->mutable_normals()->resize(12);
  ExpectInvalid(MeshFromWire(bad).status(), "arrays.normals: 1 rows for 8 vertices");
  bad = wire;
  bad.mutable_arrays()->mutable_texcoords()->resize(16);
  ExpectInvalid(MeshFromWire(bad).status(), "arrays.texcoords: 2 rows for 8 vertices");
  bad = wire;
  bad.mutable_arrays()->mutable_indices()->replace(4, 4, "\xff\xff\xff\xff");
  ExpectInvalid(MeshFromWire(bad).status(), "arrays.indices: face 0 has index 4294967295");
}

TEST(MeshWireTest, AnEmptyMeshIsLeftToCheckMesh) {
  const absl::StatusOr<TriangleMesh> read = MeshFromArrays({});
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->vertex_count(), 0);
}

TEST(MeshWireTest, AxesAndFormatsRoundTrip) {
  for (const UpAxis axis : {UpAxis::kX, UpAxis::kY, UpAxis::kZ}) {
    EXPECT_EQ(*UpAxisFromWire(UpAxisToWire(axis)), axis);
  }
  EXPECT_EQ(*UpAxisFromWire(v1::UP_AXIS_UNSPECIFIED), UpAxis::kY);
  EXPECT_THAT(std::string(UpAxisFromWire(static_cast<v1::UpAxis>(9)).status().message()), HasSubstr("9"));
  for (const MeshFormat format :
       {MeshFormat::kObj, MeshFormat::kPly, MeshFormat::kOff, MeshFormat::kStl, MeshFormat::kGlb}) {
    EXPECT_EQ(*MeshFormatFromWire(MeshFormatToWire(format)), format);
  }
  EXPECT_EQ(MeshFormatFromWire(v1::MESH_FORMAT_UNSPECIFIED).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace stance
