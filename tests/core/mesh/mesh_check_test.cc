#include "core/mesh/mesh_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string RejectionOf(const TriangleMesh& mesh, const MeshLimits& limits = {}) {
  const absl::StatusOr<MeshReport> report = CheckMesh(mesh, limits);
  EXPECT_EQ(report.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(report.status().message());
}

MeshReport ReportOf(const TriangleMesh& mesh) {
  const absl::StatusOr<MeshReport> report = CheckMesh(mesh);
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? *report : MeshReport{};
}

TEST(CheckMesh, AcceptsCleanMeshesWithoutWarnings) {
  for (const TriangleMesh& mesh :
       {testing::Icosphere(2), testing::Box(), testing::Grid(4, 3), testing::Capsule(),
        testing::WithAttributes(testing::Icosphere(1)), testing::Shuffled(testing::Icosphere(2), 7)}) {
    const MeshReport report = ReportOf(mesh);
    EXPECT_THAT(report.warnings, IsEmpty());
    EXPECT_EQ(report.components, 1);
    EXPECT_EQ(report.degenerate_faces, 0);
    EXPECT_EQ(report.unreferenced_vertices, 0);
    EXPECT_EQ(report.non_manifold_edges, 0);
  }
}

TEST(CheckMesh, RefusesAMeshWithoutVertices) { EXPECT_EQ(RejectionOf({}), "the mesh has no vertices"); }

TEST(CheckMesh, RefusesAMeshWithoutFaces) {
  TriangleMesh mesh = testing::Box();
  mesh.faces.resize(0, 3);
  EXPECT_EQ(RejectionOf(mesh), "the mesh has no faces");
}

TEST(CheckMesh, RefusesMoreThanTheLimits) {
  const TriangleMesh box = testing::Box();
  EXPECT_EQ(RejectionOf(box, {.max_vertices = 7}), "the mesh has 8 vertices; at most 7 are accepted");
  EXPECT_EQ(RejectionOf(box, {.max_vertices = 8, .max_faces = 11}),
            "the mesh has 12 faces; at most 11 are accepted");
  EXPECT_TRUE(CheckMesh(box, {.max_vertices = 8, .max_faces = 12}).ok());
}

TEST(CheckMesh, NamesTheVertexWithANonFiniteCoordinate) {
  TriangleMesh mesh = testing::Box();
  mesh.positions(5, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(RejectionOf(mesh), HasSubstr("vertex 5 has a non-finite coordinate (y = nan"));
  mesh = testing::Box();
  mesh.positions(7, 2) = -std::numeric_limits<float>::infinity();
  EXPECT_THAT(RejectionOf(mesh), HasSubstr("vertex 7 has a non-finite coordinate (z = -inf"));
}

TEST(CheckMesh, NamesTheVertexThatLiesTooFarOut) {
  TriangleMesh mesh = testing::Box();
  mesh.positions(3, 0) = -1e6f;
  EXPECT_TRUE(CheckMesh(mesh).ok());
  mesh.positions(3, 0) = -2e6f;
  EXPECT_THAT(RejectionOf(mesh), HasSubstr("vertex 3 lies too far out (x = -2000000"));
}

TEST(CheckMesh, NamesTheFaceWithAnIndexOutOfRange) {
  TriangleMesh mesh = testing::Box();
  mesh.faces(9, 2) = 8;
  EXPECT_EQ(RejectionOf(mesh), "face 9 names vertex 8, but the mesh has 8 vertices");
  mesh = testing::Box();
  mesh.faces(0, 0) = -1;
  EXPECT_EQ(RejectionOf(mesh), "face 0 names vertex -1, but the mesh has 8 vertices");
}

TEST(CheckMesh, RefusesZeroExtent) {
  TriangleMesh mesh = testing::Box();
  mesh.positions.rowwise() = Eigen::RowVector3f(1, 2, 3);
  EXPECT_EQ(RejectionOf(mesh), "the mesh has no extent: all 8 vertices lie at (1, 2, 3)");
}

TEST(CheckMesh, RefusesAttributesThatDoNotMatchTheVertices) {
  TriangleMesh mesh = testing::WithAttributes(testing::Box());
  mesh.normals.conservativeResize(7, 3);
  EXPECT_EQ(RejectionOf(mesh), "the mesh has 7 normals for 8 vertices");
  mesh = testing::WithAttributes(testing::Box());
  mesh.texcoords.conservativeResize(9, 2);
  EXPECT_EQ(RejectionOf(mesh), "the mesh has 9 texture coordinates for 8 vertices");
}

TEST(CheckMesh, WarnsOfDegenerateFaces) {
  const MeshReport report = ReportOf(testing::WithDegenerateFaces());
  EXPECT_EQ(report.degenerate_faces, 3);
  ASSERT_FALSE(report.warnings.empty());
  EXPECT_EQ(report.warnings[0], "3 degenerate faces (first: face 80)");
}

TEST(CheckMesh, DegeneracyDoesNotDependOnTheUnit) {
  TriangleMesh mesh = testing::Icosphere(2);
  mesh.positions *= 1e-5f;
  EXPECT_EQ(ReportOf(mesh).degenerate_faces, 0);
  mesh.positions *= 1e10f;
  EXPECT_EQ(ReportOf(mesh).degenerate_faces, 0);
}

TEST(CheckMesh, WarnsOfUnreferencedVertices) {
  TriangleMesh mesh = testing::Box();
  mesh.positions.conservativeResize(9, 3);
  mesh.positions.row(8).setZero();
  const MeshReport report = ReportOf(mesh);
  EXPECT_EQ(report.unreferenced_vertices, 1);
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(report.warnings, ElementsAre("1 unreferenced vertex (first: vertex 8)"));
}

TEST(CheckMesh, CountsComponents) {
  EXPECT_THAT(ReportOf(testing::TwoSpheres()).warnings, ElementsAre("2 components"));
  EXPECT_EQ(ReportOf(testing::Shuffled(testing::TwoSpheres(2), 3)).components, 2);
  EXPECT_EQ(ReportOf(testing::Unwelded(testing::Box())).components, 12);
}

TEST(CheckMesh, WarnsOfNonManifoldEdges) {
  const MeshReport report = ReportOf(testing::Fan(4));
  EXPECT_EQ(report.non_manifold_edges, 1);
  EXPECT_THAT(report.warnings, ElementsAre("1 non-manifold edge (first: between vertices 0 and 1)"));
}

TEST(CheckMesh, ReportDoesNotDependOnTheVertexOrder) {
  const TriangleMesh mesh = testing::WithDegenerateFaces();
  const MeshReport report = ReportOf(mesh);
  for (uint64_t seed = 0; seed < 5; ++seed) {
    const MeshReport shuffled = ReportOf(testing::Shuffled(mesh, seed));
    EXPECT_EQ(shuffled.degenerate_faces, report.degenerate_faces);
    EXPECT_EQ(shuffled.components, report.components);
    EXPECT_EQ(shuffled.non_manifold_edges, report.non_manifold_edges);
  }
}

TEST(CheckMesh, AcceptsAMillionVertices) {
  const MeshReport report = ReportOf(testing::Grid(999, 999));
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(report.warnings, IsEmpty());
}

TEST(CheckMesh, WarnsOfAttributesThatAreNotFinite) {
  TriangleMesh mesh = testing::WithAttributes(testing::Icosphere(1));
  mesh.normals(5, 1) = std::numeric_limits<float>::quiet_NaN();
  mesh.texcoords(7, 0) = std::numeric_limits<float>::infinity();
  const auto report = CheckMesh(mesh);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(
      report->warnings,
      (std::vector<std::string>{
          "vertex 5 has a normal that is not finite; the normals are left out",
          "vertex 7 has a texture coordinate that is not finite; the texture coordinates are left out"}));
  DropBrokenAttributes(mesh);
  EXPECT_EQ(mesh.normals.rows(), 0);
  EXPECT_EQ(mesh.texcoords.rows(), 0);
}

TEST(DropBrokenAttributes, KeepsWhatIsFinite) {
  TriangleMesh mesh = testing::WithAttributes(testing::Icosphere(1));
  const TriangleMesh before = mesh;
  DropBrokenAttributes(mesh);
  EXPECT_EQ(mesh.normals, before.normals);
  EXPECT_EQ(mesh.texcoords, before.texcoords);
}

}  // namespace
}  // namespace stance
