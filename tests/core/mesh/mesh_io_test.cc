#include "core/mesh/mesh_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "core/base/files.h"
#include "core/base/random.h"
#include "core/mesh/mesh_check.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

constexpr MeshFormat kAllFormats[] = {MeshFormat::kObj, MeshFormat::kPly, MeshFormat::kOff, MeshFormat::kStl,
                                      MeshFormat::kGlb};

TriangleMesh WriteAndParse(const TriangleMesh& mesh, MeshFormat format) {
  const absl::StatusOr<std::string> bytes = SerializeMesh(mesh, format);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  if (!bytes.ok()) return {};
  absl::StatusOr<TriangleMesh> parsed = ParseMesh(*bytes, format);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  return parsed.ok() ? *std::move(parsed) : TriangleMesh{};
}

bool WithinOneUlp(float a, float b) { return a == b || std::nextafter(a, b) == b; }

void ExpectSamePoints(const Points& actual, const Points& expected) {
  ASSERT_EQ(actual.rows(), expected.rows());
  for (int64_t v = 0; v < expected.rows(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_TRUE(WithinOneUlp(actual(v, axis), expected(v, axis)))
          << "vertex " << v << ": " << actual(v, axis) << " for " << expected(v, axis);
    }
  }
}

void ExpectSameFaces(const Faces& actual, const Faces& expected) {
  ASSERT_EQ(actual.rows(), expected.rows());
  EXPECT_EQ((actual - expected).cwiseAbs().maxCoeff(), 0);
}

class EveryFormat : public ::testing::TestWithParam<MeshFormat> {
 protected:
  bool keeps_order() const { return GetParam() != MeshFormat::kStl; }
};

INSTANTIATE_TEST_SUITE_P(MeshIo, EveryFormat, ::testing::ValuesIn(kAllFormats),
                         [](const auto& format) { return std::string(MeshFormatName(format.param)); });

TEST_P(EveryFormat, RoundTripKeepsCountsOrderAndCoordinates) {
  for (TriangleMesh mesh : {testing::Icosphere(3, 0.9f), testing::Box(1, 2, 3), testing::Grid(7, 5),
                            testing::Fan(5), testing::Shuffled(testing::TwoSpheres(2), 11)}) {
    if (!keeps_order()) {  // the order of first use survives
      mesh = WriteAndParse(mesh, GetParam());
    }
    const TriangleMesh parsed = WriteAndParse(mesh, GetParam());
    ExpectSamePoints(parsed.positions, mesh.positions);
    ExpectSameFaces(parsed.faces, mesh.faces);
    EXPECT_EQ(parsed.normals.rows(), 0);
    EXPECT_EQ(parsed.texcoords.rows(), 0);
    EXPECT_TRUE(parsed.groups.empty());
  }
}

TEST_P(EveryFormat, CoordinatesOfEverySizeSurvive) {
  Random random(5);
  TriangleMesh mesh = testing::Icosphere(3);
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      mesh.positions(v, axis) = static_cast<float>(random.Normal() * std::pow(10.0, random.Uniform(-30, 30)));
    }
  }
  mesh.positions.row(0) << std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest(),
      std::numeric_limits<float>::min();
  mesh.positions.row(1) << std::numeric_limits<float>::denorm_min(), 0.0f, 16777217.0f;
  if (!keeps_order()) mesh = WriteAndParse(mesh, GetParam());
  ExpectSamePoints(WriteAndParse(mesh, GetParam()).positions, mesh.positions);
}

TEST_P(EveryFormat, KeepsTheSurface) {
  // Corner by corner, which holds for STL's reordered vertices, too.
  const TriangleMesh mesh = testing::Shuffled(testing::Capsule(), 4);
  const TriangleMesh parsed = WriteAndParse(mesh, GetParam());
  EXPECT_EQ(parsed.vertex_count(), mesh.vertex_count());
  ExpectSamePoints(testing::Unwelded(parsed).positions, testing::Unwelded(mesh).positions);
}

TEST_P(EveryFormat, AttributesSurviveWhereTheFormatHasThem) {
  const MeshFormat format = GetParam();
  const TriangleMesh mesh = testing::WithAttributes(testing::Icosphere(2));
  const TriangleMesh parsed = WriteAndParse(mesh, format);
  if (format != MeshFormat::kStl) {
    ASSERT_EQ(parsed.normals.rows(), mesh.vertex_count());
    EXPECT_LT((parsed.normals - mesh.normals).cwiseAbs().maxCoeff(), 3e-7f);
    ASSERT_EQ(parsed.texcoords.rows(), mesh.vertex_count());
    EXPECT_LT((parsed.texcoords - mesh.texcoords).cwiseAbs().maxCoeff(), 3e-7f);
  }
  if (format == MeshFormat::kObj || format == MeshFormat::kGlb) {
    ASSERT_EQ(parsed.groups.size(), 2u);
    for (size_t g = 0; g < 2; ++g) {
      EXPECT_EQ(parsed.groups[g].name, mesh.groups[g].name);
      EXPECT_EQ(parsed.groups[g].first_face, mesh.groups[g].first_face);
      EXPECT_EQ(parsed.groups[g].face_count, mesh.groups[g].face_count);
    }
  } else {
    EXPECT_TRUE(parsed.groups.empty());
  }
}

TEST_P(EveryFormat, UnreferencedVerticesSurviveExceptInStl) {
  TriangleMesh mesh = testing::Box();
  mesh.positions.conservativeResize(10, 3);
  mesh.positions.row(8) << 7, 8, 9;
  mesh.positions.row(9) << 1, 2, 3;
  EXPECT_EQ(WriteAndParse(mesh, GetParam()).vertex_count(), keeps_order() ? 10 : 8);
}

TEST_P(EveryFormat, FacesOutsideTheGroupsAreWritten) {
  TriangleMesh mesh = testing::Box();
  mesh.groups = {{"middle", 4, 4}};
  const TriangleMesh parsed = WriteAndParse(mesh, GetParam());
  EXPECT_EQ(parsed.face_count(), 12);
  if (GetParam() != MeshFormat::kObj && GetParam() != MeshFormat::kGlb) return;
  ASSERT_EQ(parsed.groups.size(), 3u);
  EXPECT_EQ(parsed.groups[0].name, "");
  EXPECT_EQ(parsed.groups[1].name, "middle");
  EXPECT_EQ(parsed.groups[1].first_face, 4);
  EXPECT_EQ(parsed.groups[2].face_count, 4);
}

TEST_P(EveryFormat, GroupNamesCannotBreakTheFile) {
  for (const char* name : {"a\nf 1 2 3", "ends with \\", "\xff\xfe", "\"quoted\"", "  ", "#", "käse"}) {
    TriangleMesh mesh = testing::Box();
    mesh.groups = {{name, 0, 6}, {"other", 6, 6}};
    const TriangleMesh parsed = WriteAndParse(mesh, GetParam());
    EXPECT_EQ(parsed.face_count(), 12) << name;
    ExpectSameFaces(WriteAndParse(parsed, GetParam()).faces, parsed.faces);
  }
}

TEST_P(EveryFormat, RefusesToWriteABrokenMesh) {
  const auto rejection = [](const TriangleMesh& mesh) {
    const absl::StatusOr<std::string> bytes = SerializeMesh(mesh, GetParam());
    EXPECT_EQ(bytes.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(bytes.status().message());
  };
  TriangleMesh mesh = testing::Box();
  mesh.positions(3, 1) = std::numeric_limits<float>::infinity();
  EXPECT_THAT(rejection(mesh), HasSubstr("vertex 3 has a non-finite coordinate"));
  mesh = testing::Box();
  mesh.faces(5, 0) = -1;
  EXPECT_THAT(rejection(mesh), HasSubstr("face 5 names vertex -1, but there are 8"));
  mesh = testing::Box();
  mesh.normals.setZero(7, 3);
  EXPECT_THAT(rejection(mesh), HasSubstr("7 normals for 8 vertices"));
  mesh = testing::Box();
  mesh.texcoords.setZero(9, 2);
  EXPECT_THAT(rejection(mesh), HasSubstr("9 texture coordinates for 8 vertices"));
  mesh = testing::Box();
  mesh.groups = {{"limb", 8, 5}};
  EXPECT_THAT(rejection(mesh), HasSubstr("group 'limb' with 5 faces from face 8"));
  mesh.groups = {{"b", 6, 6}, {"a", 0, 6}};
  EXPECT_THAT(rejection(mesh), HasSubstr("group 'a' with 6 faces from face 0"));
}

TEST_P(EveryFormat, LeavesOutAttributesThatAreNotFinite) {
  TriangleMesh mesh = testing::WithAttributes(testing::Icosphere(1));
  mesh.normals(5, 1) = std::numeric_limits<float>::quiet_NaN();
  mesh.texcoords(7, 0) = std::numeric_limits<float>::infinity();
  const TriangleMesh parsed = WriteAndParse(mesh, GetParam());
  EXPECT_EQ(parsed.vertex_count(), mesh.vertex_count());
  EXPECT_EQ(parsed.normals.rows(), 0);
  EXPECT_EQ(parsed.texcoords.rows(), 0);
}

TEST_P(EveryFormat, ReadsUpToTheLimitsAndNoFurther) {
  const std::string bytes = *SerializeMesh(testing::Box(), GetParam());
  EXPECT_TRUE(ParseMesh(bytes, GetParam(), {.max_vertices = 8, .max_faces = 12}).ok());
  const auto rejection = [&](const MeshLimits& limits) {
    const absl::Status status = ParseMesh(bytes, GetParam(), limits).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  // STL names its vertices only corner by corner: there, CheckMesh counts them.
  if (GetParam() != MeshFormat::kStl) {
    EXPECT_THAT(rejection({.max_vertices = 7}), HasSubstr("vertices; at most 7 are accepted"));
  }
  EXPECT_THAT(rejection({.max_faces = 11}), HasSubstr("faces; at most 11 are accepted"));
}

TEST_P(EveryFormat, RefusesEmptyBytes) {
  EXPECT_EQ(ParseMesh("", GetParam()).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_P(EveryFormat, FilesGoByTheirExtension) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) /
      ("mesh_io_" + std::string(MeshFormatName(GetParam())) + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const std::filesystem::path path = folder / ("box." + std::string(MeshFormatName(GetParam())));
  ASSERT_TRUE(WriteMesh(testing::Icosphere(1), path).ok());
  ASSERT_TRUE(WriteMesh(testing::Box(), path).ok());  // replaces
  const absl::StatusOr<TriangleMesh> mesh = ReadMesh(path);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertex_count(), 8);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1) << "a file was left aside";

  ASSERT_TRUE(WriteFile(path, "nonsense").ok());
  const absl::Status broken = ReadMesh(path).status();
  EXPECT_EQ(broken.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(broken.message()), HasSubstr(path.string()));
  std::filesystem::remove_all(folder);
}

TEST(MeshIo, FormatFromName) {
  for (const MeshFormat format : kAllFormats) {
    const std::string name(MeshFormatName(format));
    EXPECT_EQ(MeshFormatFromName(name).value(), format);
    EXPECT_EQ(MeshFormatFromName("." + name).value(), format);
    EXPECT_EQ(MeshFormatFromName("a.b/some character.v2." + name).value(), format);
  }
  EXPECT_EQ(MeshFormatFromName("A.OBJ").value(), MeshFormat::kObj);
  for (const char* unknown : {"", ".", "fbx", "mesh.", "obj.gz", "object"}) {
    const absl::Status status = MeshFormatFromName(unknown).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << unknown;
    EXPECT_THAT(std::string(status.message()), HasSubstr("(obj, ply, off, stl, glb)"));
  }
}

TEST(MeshIo, AGlbNeedsAFace) {
  TriangleMesh mesh = testing::Box();
  mesh.faces.resize(0, 3);
  EXPECT_EQ(SerializeMesh(mesh, MeshFormat::kGlb).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(SerializeMesh(mesh, MeshFormat::kObj).ok());
}

TEST(MeshIo, MissingFilesAreNotFound) {
  const absl::Status status = ReadMesh("/nowhere/box.obj").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("/nowhere/box.obj"));
  EXPECT_EQ(WriteMesh(testing::Box(), "/nowhere/box.obj").code(), absl::StatusCode::kNotFound);
}

TEST(MeshIo, UnreadableFilesAreDenied) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const std::filesystem::path path =
      std::filesystem::path(::testing::TempDir()) / ("unreadable" + std::to_string(getpid()) + ".obj");
  ASSERT_TRUE(WriteMesh(testing::Box(), path).ok());
  ASSERT_EQ(chmod(path.c_str(), 0), 0);
  EXPECT_EQ(ReadMesh(path).status().code(), absl::StatusCode::kPermissionDenied);
  std::filesystem::remove(path);
}

TEST(MeshIo, UnknownExtensionsAreRefused) {
  EXPECT_EQ(ReadMesh("/tmp/box.fbx").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(WriteMesh(testing::Box(), "/tmp/box.fbx").code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace stance
