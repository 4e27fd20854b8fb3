#include "client/cli/view.h"

#include <array>

#include "core/mesh/render.h"
#include "core/transfer/up_axis.h"

namespace stance {

Points UprightPoints(const Points& points, UpAxis up) { return points * ToYUp(up).transpose(); }

absl::Status WriteViewPng(const std::vector<ViewItem>& items, const ViewCamera& camera,
                          const std::filesystem::path& path) {
  // Muted blue, sand and green; a fourth mesh starts again.
  constexpr std::array<std::array<float, 3>, 3> kColors = {
      {{0.55f, 0.66f, 0.80f}, {0.83f, 0.73f, 0.58f}, {0.58f, 0.76f, 0.62f}}};
  std::vector<TriangleMesh> upright(items.size());
  std::vector<RenderItem> tiles(items.size());
  for (size_t i = 0; i < items.size(); ++i) {
    upright[i].positions = UprightPoints(items[i].mesh->positions, items[i].up);
    upright[i].faces = items[i].mesh->faces;
    tiles[i].mesh = &upright[i];
    tiles[i].color = kColors[i % kColors.size()];
    tiles[i].caption = items[i].caption;
  }
  RenderOptions options;
  options.yaw = camera.yaw;
  options.pitch = camera.pitch;
  options.columns = camera.columns;
  return WritePng(RenderTiles(tiles, options), path);
}

}  // namespace stance
