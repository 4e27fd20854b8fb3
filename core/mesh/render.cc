#include "core/mesh/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/mesh/measure.h"
#include "core/mesh/render_canvas.h"
#include "core/mesh/render_text.h"

namespace stance {
namespace {

constexpr int kCaptionScale = 2;  // font pixels of 2x2: readable when a wide picture is shown scaled down
constexpr int kMargin = 8;        // pixels around the mesh and the caption

// Rows: the viewer's right, up and towards-the-viewer axes.
Eigen::Matrix3f ViewFrame(double yaw, double pitch) {
  const Eigen::Vector3d toward(std::sin(yaw) * std::cos(pitch), std::sin(pitch),
                               std::cos(yaw) * std::cos(pitch));
  const Eigen::Vector3d right(std::cos(yaw), 0, -std::sin(yaw));
  Eigen::Matrix3d frame;
  frame << right.transpose(), toward.cross(right).transpose(), toward.transpose();
  return frame.cast<float>();
}

// An item in the viewer's frame, metres.
struct ViewedItem {
  Points positions;
  Points joints;
  Eigen::Vector2f low = Eigen::Vector2f::Zero();
  Eigen::Vector2f high = Eigen::Vector2f::Zero();
};

ViewedItem View(const RenderItem& item, const Eigen::Matrix3f& frame) {
  ViewedItem viewed;
  if (item.mesh != nullptr) viewed.positions = item.mesh->positions * frame.transpose();
  viewed.joints = item.joints * frame.transpose();
  bool any = false;
  for (const Points* points : {&viewed.positions, &viewed.joints}) {
    if (points->rows() == 0) continue;
    const Eigen::Vector2f low = points->leftCols<2>().colwise().minCoeff().transpose();
    const Eigen::Vector2f high = points->leftCols<2>().colwise().maxCoeff().transpose();
    viewed.low = any ? viewed.low.cwiseMin(low).eval() : low;
    viewed.high = any ? viewed.high.cwiseMax(high).eval() : high;
    any = true;
  }
  return viewed;
}

// From the viewer's metres to canvas pixels: x' = scale * x + offset_x, y' = -scale * y + offset_y.
struct Placement {
  float scale;
  float offset_x, offset_y;

  Eigen::Vector3f Apply(const Eigen::Vector3f& p) const {
    return {scale * p.x() + offset_x, -scale * p.y() + offset_y, scale * p.z()};
  }
};

void DrawMesh(const RenderItem& item, const ViewedItem& viewed, const Placement& placement, Canvas& canvas) {
  const Faces& faces = item.mesh->faces;
  const Points normals = VertexNormals(viewed.positions, faces);
  const bool own_colors = item.vertex_colors.rows() > 0;
  STANCE_CHECK(!own_colors || item.vertex_colors.rows() == viewed.positions.rows());
  const Eigen::Vector3f base(item.color[0], item.color[1], item.color[2]);
  std::array<CanvasVertex, 3> corners;
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int32_t v = faces(f, corner);
      corners[corner].position = placement.Apply(viewed.positions.row(v).transpose());
      corners[corner].normal = normals.row(v).transpose();
      corners[corner].color = own_colors ? Eigen::Vector3f(item.vertex_colors.row(v).transpose()) : base;
    }
    canvas.DrawTriangle(corners);
  }
}

// Two passes, so that every outline lies beneath every filling.
void DrawSkeleton(const RenderItem& item, const ViewedItem& viewed, const Placement& placement, float pixel,
                  Canvas& canvas) {
  STANCE_CHECK(item.parents.empty() || static_cast<Eigen::Index>(item.parents.size()) == item.joints.rows());
  const Eigen::Vector3f outline(0.1f, 0.1f, 0.12f), bone(1.0f, 0.72f, 0.2f), joint(0.85f, 0.2f, 0.15f);
  const auto place = [&](Eigen::Index j) -> Eigen::Vector2f {
    return placement.Apply(viewed.joints.row(j).transpose()).head<2>();
  };
  for (const bool outlines : {true, false}) {
    const float grow = outlines ? pixel : 0.0f;
    for (size_t j = 0; j < item.parents.size(); ++j) {
      if (item.parents[j] < 0) continue;
      canvas.DrawCapsule(place(item.parents[j]), place(static_cast<Eigen::Index>(j)), 1.6f * pixel + grow,
                         outlines ? outline : bone);
    }
    for (Eigen::Index j = 0; j < viewed.joints.rows(); ++j) {
      canvas.DrawCapsule(place(j), place(j), 3.0f * pixel + grow, outlines ? outline : joint);
    }
  }
}

// The largest font at which every caption fits its tile; 1 if none does.
int CaptionScale(const std::vector<RenderItem>& items, int tile_width) {
  int scale = kCaptionScale;
  for (const RenderItem& item : items) {
    while (scale > 1 && TextWidth(item.caption, scale) > tile_width - 2 * kMargin) --scale;
  }
  return scale;
}

// Centred at the bottom of the tile; cut where it would not fit.
void DrawCaption(const std::string& caption, int scale, int left, int bottom, int tile_width, Image& image) {
  std::string text = caption;
  while (!text.empty() && TextWidth(text, scale) > tile_width - 2 * kMargin) text.pop_back();
  DrawText(image, left + (tile_width - TextWidth(text, scale)) / 2, bottom - kMargin - TextHeight(scale),
           scale, text);
}

}  // namespace

Image RenderTiles(const std::vector<RenderItem>& items, const RenderOptions& options) {
  Image image;
  if (items.empty()) return image;
  STANCE_CHECK(options.tile_width > 0 && options.tile_height > 0 && options.supersampling > 0 &&
               options.columns >= 0);
  const int count = static_cast<int>(items.size());
  const int columns = options.columns == 0 ? count : std::min(options.columns, count);
  const int rows = (count + columns - 1) / columns;
  image.width = columns * options.tile_width;
  image.height = rows * options.tile_height;
  image.rgb.assign(static_cast<size_t>(image.width) * image.height * 3, 255);

  const bool captions =
      std::any_of(items.begin(), items.end(), [](const RenderItem& item) { return !item.caption.empty(); });
  const int picture_height =
      std::max(1, options.tile_height - (captions ? TextHeight(kCaptionScale) + 2 * kMargin : 0));
  const Eigen::Vector2f room(std::max(1, options.tile_width - 2 * kMargin),
                             std::max(1, picture_height - 2 * kMargin));
  const Eigen::Matrix3f frame = ViewFrame(options.yaw, options.pitch);
  std::vector<ViewedItem> viewed;
  float scale = 0;  // pixels per metre: the largest at which every item fits; 0 while nothing has an extent
  for (const RenderItem& item : items) {
    viewed.push_back(View(item, frame));
    const Eigen::Vector2f extent = viewed.back().high - viewed.back().low;
    for (int axis = 0; axis < 2; ++axis) {
      if (!(extent[axis] > 0) || !std::isfinite(extent[axis])) continue;
      const float fits = room[axis] / extent[axis];
      scale = scale == 0 ? fits : std::min(scale, fits);
    }
  }

  const int factor = options.supersampling, caption_scale = CaptionScale(items, options.tile_width);
  for (int i = 0; i < count; ++i) {
    const int left = i % columns * options.tile_width, top = i / columns * options.tile_height;
    Canvas canvas(options.tile_width * factor, picture_height * factor);
    const Eigen::Vector2f center = (viewed[i].low + viewed[i].high) / 2;
    const float pixels = scale * static_cast<float>(factor);
    const Placement placement{pixels, static_cast<float>(canvas.width()) / 2 - pixels * center.x(),
                              static_cast<float>(canvas.height()) / 2 + pixels * center.y()};
    if (items[i].mesh != nullptr) DrawMesh(items[i], viewed[i], placement, canvas);
    DrawSkeleton(items[i], viewed[i], placement, static_cast<float>(factor), canvas);
    canvas.Downsample(factor, left, top, image);
    DrawCaption(items[i].caption, caption_scale, left, top + options.tile_height, options.tile_width, image);
  }
  return image;
}

}  // namespace stance
