#include "core/mesh/farthest_point.h"

#include <algorithm>
#include <limits>
#include <nanoflann.hpp>

#include "core/base/multiversion.h"

namespace stance {
namespace {

// Coordinates by axis, so that the loop over rows is one stride.
struct Axes {
  std::vector<float> x, y, z;
  explicit Axes(const Points& points) : x(points.rows()), y(points.rows()), z(points.rows()) {
    for (int64_t i = 0; i < points.rows(); ++i) {
      x[i] = points(i, 0);
      y[i] = points(i, 1);
      z[i] = points(i, 2);
    }
  }
};

// distance[i] = min(distance[i], |p_i - q|^2); returns the largest afterwards.
STANCE_MULTIVERSION float Relax(const float* x, const float* y, const float* z, int64_t n, float qx, float qy,
                                float qz, float* distance) {
  constexpr int kLanes = 16;  // independent maxima, so that the reduction vectorises without -ffast-math
  float largest[kLanes] = {};
  int64_t i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float dx = x[i + lane] - qx, dy = y[i + lane] - qy, dz = z[i + lane] - qz;
      const float d = dx * dx + dy * dy + dz * dz;
      const float least = d < distance[i + lane] ? d : distance[i + lane];
      distance[i + lane] = least;
      largest[lane] = least > largest[lane] ? least : largest[lane];
    }
  }
  for (; i < n; ++i) {
    const float dx = x[i] - qx, dy = y[i] - qy, dz = z[i] - qz;
    distance[i] = std::min(distance[i], dx * dx + dy * dy + dz * dz);
    largest[0] = std::max(largest[0], distance[i]);
  }
  return *std::max_element(largest, largest + kLanes);
}

struct PointAdaptor {
  const Points& points;
  size_t kdtree_get_point_count() const { return points.rows(); }
  float kdtree_get_pt(size_t row, size_t axis) const {
    return points(static_cast<int64_t>(row), static_cast<int64_t>(axis));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

}  // namespace

std::vector<int32_t> FarthestPoints(const Points& points, int64_t count) {
  const int64_t n = points.rows();
  std::vector<int32_t> chosen;
  if (n == 0 || count <= 0) return chosen;
  const Eigen::RowVector3f centroid = points.cast<double>().colwise().mean().cast<float>();
  Eigen::Index next;
  (points.rowwise() - centroid).rowwise().squaredNorm().maxCoeff(&next);
  const Axes axes(points);
  std::vector<float> distance(n, std::numeric_limits<float>::infinity());
  chosen.reserve(std::min(n, count));
  while (static_cast<int64_t>(chosen.size()) < std::min(n, count)) {
    chosen.push_back(static_cast<int32_t>(next));
    const float largest = Relax(axes.x.data(), axes.y.data(), axes.z.data(), n, points(next, 0),
                                points(next, 1), points(next, 2), distance.data());
    if (!(largest > 0)) break;
    next = std::find(distance.begin(), distance.end(), largest) - distance.begin();
  }
  return chosen;
}

std::vector<int32_t> NearestRow(const Points& queries, const Points& points) {
  const PointAdaptor adaptor{points};
  const nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointAdaptor>, PointAdaptor,
                                            3, uint32_t>
      tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  std::vector<int32_t> nearest(queries.rows());
  for (int64_t i = 0; i < queries.rows(); ++i) {
    uint32_t index = 0;
    float distance = 0;
    const Eigen::Vector3f query = queries.row(i).transpose();
    tree.knnSearch(query.data(), 1, &index, &distance);
    nearest[i] = static_cast<int32_t>(index);
  }
  return nearest;
}

}  // namespace stance
