#include "core/mesh/nearest_rows.h"

#include <algorithm>
#include <nanoflann.hpp>

namespace stance {
namespace {

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

NeighborTable NearestRows(const Points& queries, const Points& points, int k) {
  const PointAdaptor adaptor{points};
  const nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointAdaptor>, PointAdaptor,
                                            3, uint32_t>
      tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  NeighborTable nearest(queries.rows(), k);
  std::vector<uint32_t> rows(k);
  std::vector<float> distances(k);
  for (int64_t i = 0; i < queries.rows(); ++i) {
    const Eigen::Vector3f query = queries.row(i).transpose();
    const auto found = static_cast<int>(tree.knnSearch(query.data(), k, rows.data(), distances.data()));
    for (int n = 0; n < k; ++n) nearest(i, n) = static_cast<int32_t>(rows[std::min(n, found - 1)]);
  }
  return nearest;
}

std::vector<int32_t> NearestRow(const Points& queries, const Points& points) {
  const NeighborTable nearest = NearestRows(queries, points, 1);
  return {nearest.data(), nearest.data() + nearest.size()};
}

}  // namespace stance
