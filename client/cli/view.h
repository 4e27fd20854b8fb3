// Pictures of a transfer and of meshes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct ViewItem {
  const TriangleMesh* mesh = nullptr;
  UpAxis up = UpAxis::kY;
  std::string caption;
};

struct ViewCamera {
  double yaw = 0.35;    // radians, as in RenderOptions
  double pitch = 0.08;  // radians
  int columns = 0;
};

// Points (V, 3) turned so that `up` becomes +y. A rotation: it keeps the handedness.
Points UprightPoints(const Points& points, UpAxis up);

// The meshes side by side, upright. REQUIRES: valid indices.
absl::Status WriteViewPng(const std::vector<ViewItem>& items, const ViewCamera& camera,
                          const std::filesystem::path& path);

// The same as one HTML page that needs no other file and no network: drag to turn all meshes, scroll to zoom.
std::string ViewHtml(const std::vector<ViewItem>& items);

}  // namespace stance
