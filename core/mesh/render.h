// A small software renderer, so that every tool and test can look at its meshes without a display.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

// 8-bit RGB, rows from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgb;
};

struct RenderItem {
  const TriangleMesh* mesh = nullptr;
  // Base colour of the surface, or per-vertex colours (V, 3) in 0..1 when it has rows.
  std::array<float, 3> color = {0.72f, 0.74f, 0.78f};
  Points vertex_colors = {};
  // Drawn over the mesh as bones if it has rows: joints (J, 3) and parents.
  Points joints = {};
  std::vector<int> parents = {};
  // Written under the picture.
  std::string caption = {};
};

struct RenderOptions {
  int tile_width = 400;
  int tile_height = 560;
  double yaw = 0.35;    // radians about +y; 0 looks along -z at a character that faces +z
  double pitch = 0.08;  // radians, positive looks down
  int supersampling = 2;
  int columns = 0;  // tiles per row; 0: all in one row
};

// One tile per item, side by side, orthographic, all at the same scale (the largest at which each fits its
// tile), two-sided soft shading with smooth normals and a z-buffer, on white. An item without a mesh leaves
// its tile to its caption; no items give an image of 0 x 0. REQUIRES: meshes have valid indices (CheckMesh);
// vertex_colors, where given, has a row per vertex.
Image RenderTiles(const std::vector<RenderItem>& items, const RenderOptions& options = {});

// INVALID_ARGUMENT for an empty image; otherwise WriteFile's errors (core/base/files.h), with the path.
absl::Status WritePng(const Image& image, const std::filesystem::path& path);

}  // namespace stance
