#include "core/mesh/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/files.h"

namespace stance {
namespace {

// A sphere of the given radius from a latitude-longitude grid, outward winding.
TriangleMesh Sphere(float radius, const Eigen::Vector3f& center = Eigen::Vector3f::Zero()) {
  constexpr int kRings = 48, kSegments = 96;
  TriangleMesh mesh;
  mesh.positions.resize((kRings + 1) * kSegments, 3);
  for (int ring = 0; ring <= kRings; ++ring) {
    const double polar = std::numbers::pi * ring / kRings;
    for (int segment = 0; segment < kSegments; ++segment) {
      const double azimuth = 2 * std::numbers::pi * segment / kSegments;
      const Eigen::Vector3d direction(std::sin(polar) * std::sin(azimuth), std::cos(polar),
                                      std::sin(polar) * std::cos(azimuth));
      mesh.positions.row(ring * kSegments + segment) =
          (center + radius * direction.cast<float>()).transpose();
    }
  }
  mesh.faces.resize(2 * kRings * kSegments, 3);
  for (int ring = 0, f = 0; ring < kRings; ++ring) {
    for (int segment = 0; segment < kSegments; ++segment) {
      const int a = ring * kSegments + segment, b = ring * kSegments + (segment + 1) % kSegments;
      mesh.faces.row(f++) << a, a + kSegments, b + kSegments;
      mesh.faces.row(f++) << a, b + kSegments, b;
    }
  }
  return mesh;
}

// A square of side 2 facing +z at the given depth.
TriangleMesh Wall(float z) {
  TriangleMesh mesh;
  mesh.positions = Points{{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
  mesh.faces = Faces{{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

RenderOptions FrontView() {
  RenderOptions options;
  options.tile_width = 200;
  options.tile_height = 200;
  options.yaw = 0;
  options.pitch = 0;
  return options;
}

std::array<int, 3> PixelAt(const Image& image, int x, int y) {
  const uint8_t* pixel = &image.rgb[(static_cast<size_t>(y) * image.width + x) * 3];
  return {pixel[0], pixel[1], pixel[2]};
}

// Pixels with ink among the columns [begin, end).
int CountInk(const Image& image, int begin, int end) {
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = begin; x < end; ++x) count += PixelAt(image, x, y) != std::array<int, 3>{255, 255, 255};
  }
  return count;
}

// The picture leaves a margin of 8 pixels, so a lone sphere's radius is (200 - 16) / 2 = 92 pixels.
TEST(RenderTiles, SphereCoversTheAreaOfADisc) {
  const TriangleMesh sphere = Sphere(0.3f, {5, -2, 7});
  for (const double yaw : {0.0, 0.7, 3.0}) {
    RenderOptions options = FrontView();
    options.yaw = yaw;
    options.pitch = 0.4;
    options.supersampling = 1;
    const Image image = RenderTiles({{.mesh = &sphere}}, options);
    const double disc = std::numbers::pi * 92 * 92;
    EXPECT_NEAR(CountInk(image, 0, 200), disc, 0.01 * disc) << "yaw " << yaw;
  }
}

TEST(RenderTiles, TilesShareOneScale) {
  const TriangleMesh large = Sphere(1), small = Sphere(0.5f);
  RenderOptions options = FrontView();
  options.supersampling = 1;
  const Image image = RenderTiles({{.mesh = &large}, {.mesh = &small}}, options);
  ASSERT_EQ(image.width, 400);
  ASSERT_EQ(image.height, 200);
  const double disc = std::numbers::pi * 92 * 92;
  EXPECT_NEAR(CountInk(image, 0, 200), disc, 0.01 * disc);
  EXPECT_NEAR(CountInk(image, 200, 400), disc / 4, 0.01 * disc);
}

TEST(RenderTiles, NearerSurfaceHidesFartherWhateverTheOrderOfFaces) {
  for (const bool near_first : {true, false}) {
    const TriangleMesh first = Wall(near_first ? 1.0f : -1.0f), second = Wall(near_first ? -1.0f : 1.0f);
    TriangleMesh both = first;
    both.positions.conservativeResize(8, 3);
    both.positions.bottomRows(4) = second.positions;
    both.faces.conservativeResize(4, 3);
    both.faces.bottomRows(2) = second.faces.array() + 4;
    RenderItem item{.mesh = &both};
    item.vertex_colors = Points::Zero(8, 3);
    for (int v = 0; v < 8; ++v) item.vertex_colors(v, both.positions(v, 2) > 0 ? 0 : 2) = 1;  // near red
    const Image image = RenderTiles({item}, FrontView());
    const auto [red, green, blue] = PixelAt(image, 100, 100);
    EXPECT_GT(red, 100);
    EXPECT_EQ(blue, 0);
  }
}

TEST(RenderTiles, BackFacesAreShadedLikeFrontFaces) {
  const TriangleMesh front = Wall(0);
  TriangleMesh back = front;
  back.faces.col(1).swap(back.faces.col(2));
  EXPECT_EQ(RenderTiles({{.mesh = &front}}, FrontView()).rgb,
            RenderTiles({{.mesh = &back}}, FrontView()).rgb);
}

// Seen from +z, +x is on the right and +y at the top; a quarter turn of the camera brings +x to the front.
TEST(RenderTiles, AxesAndYaw) {
  TriangleMesh mesh = Wall(0);
  RenderItem item{.mesh = &mesh};
  item.vertex_colors = Points{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  const Image image = RenderTiles({item}, FrontView());
  const auto lower_right = PixelAt(image, 186, 186);
  EXPECT_GT(lower_right[1], lower_right[0]);  // vertex 1 at (1, -1) is green
  const auto upper_right = PixelAt(image, 186, 14);
  EXPECT_GT(upper_right[2], upper_right[0]);  // vertex 2 at (1, 1) is blue

  TriangleMesh pair = Sphere(0.2f, {1, 0, 0});
  const TriangleMesh farther = Sphere(0.2f, {-1, 0, 0});
  const auto offset = static_cast<int32_t>(pair.vertex_count());
  pair.positions.conservativeResize(2 * offset, 3);
  pair.positions.bottomRows(offset) = farther.positions;
  const Eigen::Index faces = pair.faces.rows();
  pair.faces.conservativeResize(2 * faces, 3);
  pair.faces.bottomRows(faces) = farther.faces.array() + offset;
  RenderItem spheres{.mesh = &pair};
  spheres.vertex_colors = Points::Zero(2 * offset, 3);
  spheres.vertex_colors.topRows(offset).col(0).setOnes();     // +x red
  spheres.vertex_colors.bottomRows(offset).col(2).setOnes();  // -x blue
  RenderOptions options = FrontView();
  options.yaw = std::numbers::pi / 2;
  const Image turned = RenderTiles({spheres}, options);
  const auto center = PixelAt(turned, 100, 100);
  EXPECT_GT(center[0], 100);
  EXPECT_EQ(center[2], 0);
}

TEST(RenderTiles, SkeletonIsDrawnOverTheMesh) {
  const TriangleMesh wall = Wall(5);
  RenderItem item{.mesh = &wall};
  const Image bare = RenderTiles({item}, FrontView());
  item.joints = Points{{-0.5f, 0, 0}, {0.5f, 0, 0}};  // behind the wall
  item.parents = {-1, 0};
  const Image overlaid = RenderTiles({item}, FrontView());
  EXPECT_NE(PixelAt(overlaid, 100, 100), PixelAt(bare, 100, 100));  // the bone's middle
  EXPECT_NE(PixelAt(overlaid, 54, 100), PixelAt(bare, 54, 100));    // the first joint
  EXPECT_EQ(PixelAt(overlaid, 100, 40), PixelAt(bare, 100, 40));
}

TEST(RenderTiles, CaptionIsWrittenUnderThePicture) {
  const TriangleMesh wall = Wall(0);
  const Image image = RenderTiles(
      {{.mesh = &wall, .caption = "source \xc3"}, {.caption = std::string(500, 'M')}}, FrontView());
  const auto ink_below = [&](int begin, int end) {
    int count = 0;
    for (int y = 200 - 8 - 14; y < 200; ++y) {
      for (int x = begin; x < end; ++x) count += PixelAt(image, x, y)[0] < 100;
    }
    return count;
  };
  EXPECT_GT(ink_below(0, 200), 50);
  EXPECT_GT(ink_below(200, 400), 50);
  EXPECT_EQ(ink_below(392, 400), 0);  // a caption that is too long stops at its tile's margin
}

TEST(RenderTiles, ColumnsBreakRows) {
  const TriangleMesh wall = Wall(0);
  RenderOptions options = FrontView();
  options.columns = 2;
  const Image image = RenderTiles({{.mesh = &wall}, {.mesh = &wall}, {.mesh = &wall}}, options);
  EXPECT_EQ(image.width, 400);
  EXPECT_EQ(image.height, 400);
  EXPECT_EQ(PixelAt(image, 300, 300), (std::array<int, 3>{255, 255, 255}));
  EXPECT_NE(PixelAt(image, 100, 300), (std::array<int, 3>{255, 255, 255}));
}

TEST(RenderTiles, NoItemsGiveAnEmptyImage) {
  const Image image = RenderTiles({});
  EXPECT_EQ(image.width, 0);
  EXPECT_EQ(image.height, 0);
  EXPECT_TRUE(image.rgb.empty());
}

TEST(RenderTiles, DegenerateAndEmptyMeshesLeaveTheTileWhite) {
  const TriangleMesh empty;
  TriangleMesh point;
  point.positions = Points::Zero(3, 3);
  point.faces = Faces{{0, 1, 2}};
  const Image image = RenderTiles({{.mesh = &empty}, {.mesh = &point}}, FrontView());
  EXPECT_EQ(CountInk(image, 0, 400), 0);
}

TEST(WritePng, HasMagicAndDimensions) {
  const TriangleMesh sphere = Sphere(1);
  RenderOptions options = FrontView();
  options.tile_width = 130;
  options.tile_height = 70;
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "stance_render_test.png";
  ASSERT_TRUE(WritePng(RenderTiles({{.mesh = &sphere}}, options), path).ok());
  const auto bytes = ReadFile(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(bytes.ok());
  ASSERT_GT(bytes->size(), 24u);
  EXPECT_EQ(bytes->substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(bytes->substr(12, 4), "IHDR");
  EXPECT_EQ(bytes->substr(16, 8), std::string("\0\0\0\x82\0\0\0\x46", 8));  // big-endian 130 and 70
}

TEST(WritePng, RefusesAnEmptyImage) {
  const absl::Status status = WritePng(Image{}, "nowhere.png");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("0 x 0"));
}

TEST(WritePng, NamesAFolderThatDoesNotExist) {
  Image pixel{.width = 1, .height = 1, .rgb = {1, 2, 3}};
  const absl::Status status = WritePng(pixel, "/nonexistent-folder/x.png");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("/nonexistent-folder/x.png"));
}

}  // namespace
}  // namespace stance
