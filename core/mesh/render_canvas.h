// The picture that the renderer draws into: floating-point colours and a depth per pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/mesh/render.h"

namespace stance {

// A triangle's corner on the canvas.
struct CanvasVertex {
  Eigen::Vector3f position;  // x and y in pixels from the upper left, z towards the viewer
  Eigen::Vector3f normal;    // in the viewer's frame: x right, y up, z towards the viewer; any length
  Eigen::Vector3f color;     // RGB in 0..1
};

// Not thread-safe. Everything is clipped to the canvas.
class Canvas {
 public:
  // White, infinitely deep.
  Canvas(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }

  // Fills the pixels whose centres lie inside, where nothing nearer stands; shades with interpolated normals,
  // turned towards the viewer (two-sided).
  void DrawTriangle(const std::array<CanvasVertex, 3>& corners);

  // A thick line with round ends, over everything drawn so far.
  void DrawCapsule(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float radius,
                   const Eigen::Vector3f& color);

  // Averages factor x factor pixels into one and writes the result at (left, top) of the image.
  void Downsample(int factor, int left, int top, Image& image) const;

 private:
  size_t Pixel(int x, int y) const { return static_cast<size_t>(y) * width_ + x; }

  const int width_;
  const int height_;
  std::vector<Eigen::Vector3f> color_;
  std::vector<float> depth_;
};

}  // namespace stance
