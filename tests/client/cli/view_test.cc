#include "client/cli/view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <filesystem>

namespace stance {
namespace {

TriangleMesh Tetrahedron() {
  TriangleMesh mesh;
  mesh.positions.resize(4, 3);
  mesh.positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  mesh.faces.resize(4, 3);
  mesh.faces << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  return mesh;
}

TEST(UprightPointsTest, BringsEachAxisUpByARotation) {
  const Points axes = Eigen::Matrix3f::Identity();
  for (const auto& [up, column] :
       {std::pair(UpAxis::kX, 0), std::pair(UpAxis::kY, 1), std::pair(UpAxis::kZ, 2)}) {
    const Points upright = UprightPoints(axes, up);
    EXPECT_EQ(upright.row(column), Eigen::RowVector3f::UnitY());
    EXPECT_FLOAT_EQ(Eigen::Matrix3f(upright).determinant(), 1.0f);
  }
}

TEST(ViewHtmlTest, HoldsEveryMeshAndNoOtherFile) {
  const TriangleMesh mesh = Tetrahedron();
  const std::string html = ViewHtml({{&mesh, UpAxis::kY, "first"}, {&mesh, UpAxis::kZ, "second"}});
  EXPECT_THAT(html, testing::StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(html, testing::HasSubstr("\"caption\":\"first\""));
  EXPECT_THAT(html, testing::HasSubstr("\"caption\":\"second\""));
  EXPECT_THAT(html, testing::HasSubstr("\"index_count\":12"));
  // Twelve little-endian indices 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3 in Base64.
  EXPECT_THAT(html, testing::HasSubstr("AAAAAAIAAAABAAAAAAAAAAEAAAADAAAAAAAAAAMAAAACAAAAAQAAAAIAAAADAAAA"));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("http")));
}

TEST(ViewHtmlTest, ACaptionCannotEndTheScript) {
  const TriangleMesh mesh = Tetrahedron();
  const std::string html = ViewHtml({{&mesh, UpAxis::kY, "</script><script>alert(1)"}});
  EXPECT_EQ(html.find("</script>"), html.rfind("</script>"));
}

TEST(WriteViewPngTest, WritesAPng) {
  const TriangleMesh mesh = Tetrahedron();
  const auto path = std::filesystem::path(testing::TempDir()) / "view_test.png";
  ASSERT_TRUE(WriteViewPng({{&mesh, UpAxis::kY, "tetrahedron"}}, {}, path).ok());
  EXPECT_GT(std::filesystem::file_size(path), 100u);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace stance
