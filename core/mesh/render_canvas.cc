#include "core/mesh/render_canvas.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"

namespace stance {
namespace {

// A key light from the upper left before the character and a weaker, cooler fill from the right, both soft
// (half-Lambert), darkened a little towards the silhouette so that limbs stand out from the trunk.
Eigen::Vector3f Shade(const Eigen::Vector3f& color, const Eigen::Vector3f& normal) {
  static const Eigen::Vector3f kKey = Eigen::Vector3f(-0.45f, 0.65f, 0.75f).normalized();
  static const Eigen::Vector3f kFill = Eigen::Vector3f(0.85f, -0.1f, 0.5f).normalized();
  const float key = 0.5f + 0.5f * normal.dot(kKey);
  const float fill = std::max(0.0f, normal.dot(kFill));
  const Eigen::Vector3f light = Eigen::Vector3f(1.0f, 0.98f, 0.95f) * (0.95f * key * key) +
                                Eigen::Vector3f(0.85f, 0.92f, 1.0f) * (0.22f * fill) +
                                Eigen::Vector3f::Constant(0.12f);
  const float rim = 0.62f + 0.38f * std::sqrt(std::clamp(normal.z(), 0.0f, 1.0f));
  return (color.cwiseProduct(light) * rim).cwiseMin(1.0f);
}

// Twice the signed area of the triangle (a, b, p).
float Cross(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float px, float py) {
  return (b.x() - a.x()) * (py - a.y()) - (b.y() - a.y()) * (px - a.x());
}

}  // namespace

Canvas::Canvas(int width, int height)
    : width_(width),
      height_(height),
      color_(static_cast<size_t>(width) * height, Eigen::Vector3f::Ones()),
      depth_(static_cast<size_t>(width) * height, -std::numeric_limits<float>::infinity()) {}

void Canvas::DrawTriangle(const std::array<CanvasVertex, 3>& corners) {
  const Eigen::Vector3f &a = corners[0].position, &b = corners[1].position, &c = corners[2].position;
  const float area = Cross(a, b, c.x(), c.y());
  if (!std::isfinite(area) || area == 0) return;
  // The image's y points down, so a triangle that is counter-clockwise to the viewer has a negative area
  // here.
  const float side = area < 0 ? 1.0f : -1.0f;
  const int x0 = std::max(0, static_cast<int>(std::floor(std::min({a.x(), b.x(), c.x()}))));
  const int x1 = std::min(width_ - 1, static_cast<int>(std::ceil(std::max({a.x(), b.x(), c.x()}))));
  const int y0 = std::max(0, static_cast<int>(std::floor(std::min({a.y(), b.y(), c.y()}))));
  const int y1 = std::min(height_ - 1, static_cast<int>(std::ceil(std::max({a.y(), b.y(), c.y()}))));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const float px = static_cast<float>(x) + 0.5f, py = static_cast<float>(y) + 0.5f;
      const float wa = Cross(b, c, px, py) / area, wb = Cross(c, a, px, py) / area, wc = 1 - wa - wb;
      if (wa < 0 || wb < 0 || wc < 0) continue;
      const float depth = wa * a.z() + wb * b.z() + wc * c.z();
      const size_t pixel = Pixel(x, y);
      if (depth <= depth_[pixel]) continue;
      depth_[pixel] = depth;
      Eigen::Vector3f normal =
          side * (wa * corners[0].normal + wb * corners[1].normal + wc * corners[2].normal);
      normal.z() = std::max(normal.z(), 0.0f);  // an interpolated normal may turn away at the silhouette
      const float norm = normal.norm();
      normal = norm > 1e-12f ? Eigen::Vector3f(normal / norm) : Eigen::Vector3f(0, 0, 1);
      color_[pixel] = Shade(wa * corners[0].color + wb * corners[1].color + wc * corners[2].color, normal);
    }
  }
}

void Canvas::DrawCapsule(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float radius,
                         const Eigen::Vector3f& color) {
  if (!from.allFinite() || !to.allFinite()) return;
  const Eigen::Vector2f axis = to - from;
  const float squared = axis.squaredNorm();
  const auto clamp_to = [](float value, int limit) {
    return static_cast<int>(std::clamp(value, 0.0f, static_cast<float>(limit)));
  };
  const int x0 = clamp_to(std::min(from.x(), to.x()) - radius - 1, width_);
  const int x1 = clamp_to(std::max(from.x(), to.x()) + radius + 1, width_);
  const int y0 = clamp_to(std::min(from.y(), to.y()) - radius - 1, height_);
  const int y1 = clamp_to(std::max(from.y(), to.y()) + radius + 1, height_);
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const Eigen::Vector2f point(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const float along = squared > 0 ? std::clamp((point - from).dot(axis) / squared, 0.0f, 1.0f) : 0.0f;
      if ((point - from - along * axis).squaredNorm() <= radius * radius) color_[Pixel(x, y)] = color;
    }
  }
}

void Canvas::Downsample(int factor, int left, int top, Image& image) const {
  const int width = width_ / factor, height = height_ / factor;
  STANCE_CHECK(left >= 0 && top >= 0 && left + width <= image.width && top + height <= image.height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int dy = 0; dy < factor; ++dy) {
        for (int dx = 0; dx < factor; ++dx) sum += color_[Pixel(x * factor + dx, y * factor + dy)];
      }
      const Eigen::Vector3f mean = sum * (255.0f / static_cast<float>(factor * factor));
      uint8_t* out = &image.rgb[(static_cast<size_t>(top + y) * image.width + left + x) * 3];
      for (int channel = 0; channel < 3; ++channel) out[channel] = static_cast<uint8_t>(mean[channel] + 0.5f);
    }
  }
}

}  // namespace stance
