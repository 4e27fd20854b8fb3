#include "core/mesh/farthest_point.h"

#include <algorithm>
#include <limits>

#include "core/base/multiversion.h"

namespace stance {
namespace {

constexpr int64_t kBlock = 64;

// Rows along a space-filling curve, so that the rows of a block lie together.
std::vector<int32_t> MortonOrder(const Points& points) {
  const Eigen::RowVector3f low = points.colwise().minCoeff(), high = points.colwise().maxCoeff();
  const float width = std::max((high - low).maxCoeff(), std::numeric_limits<float>::min());
  const auto spread = [](uint32_t v) {  // ten bits, two zeros between each two
    v = (v | (v << 16)) & 0x030000ff;
    v = (v | (v << 8)) & 0x0300f00f;
    v = (v | (v << 4)) & 0x030c30c3;
    return (v | (v << 2)) & 0x09249249;
  };
  std::vector<uint64_t> keys(points.rows());
  for (int64_t i = 0; i < points.rows(); ++i) {
    uint64_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float place = (points(i, axis) - low[axis]) / width * 1023;
      code |= static_cast<uint64_t>(spread(static_cast<uint32_t>(std::clamp(place, 0.0f, 1023.0f)))) << axis;
    }
    keys[i] = (code << 32) | static_cast<uint64_t>(i);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<int32_t> order(points.rows());
  for (size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<int32_t>(keys[i] & 0xffffffff);
  return order;
}

// Rows in blocks that lie together, each with its box and the largest of its rows' squared distances to
// what has been chosen: most blocks are too far from a choice for it to matter.
struct Blocks {
  std::vector<float> x, y, z, distance;  // of the rows, the last block padded with copies of its last row
  std::vector<float> low[3], high[3];    // of the blocks
  std::vector<float> largest;

  Blocks(const Points& points, const std::vector<int32_t>& order) {
    const auto blocks = static_cast<size_t>((points.rows() + kBlock - 1) / kBlock);
    for (std::vector<float>* rows : {&x, &y, &z}) rows->resize(blocks * kBlock);
    distance.assign(blocks * kBlock, std::numeric_limits<float>::infinity());
    largest.assign(blocks, std::numeric_limits<float>::infinity());
    for (size_t i = 0; i < x.size(); ++i) {
      const int32_t row = order[std::min(i, order.size() - 1)];
      x[i] = points(row, 0);
      y[i] = points(row, 1);
      z[i] = points(row, 2);
    }
    int axis = 0;
    for (const std::vector<float>* rows : {&x, &y, &z}) {
      for (size_t b = 0; b < blocks; ++b) {
        const auto first = rows->begin() + static_cast<int64_t>(b) * kBlock;
        const auto [least, most] = std::minmax_element(first, first + kBlock);
        low[axis].push_back(*least);
        high[axis].push_back(*most);
      }
      ++axis;
    }
  }
};

// bound[b] = the least squared distance of block b's box from q.
STANCE_MULTIVERSION void BoxDistances(const float* low_x, const float* high_x, const float* low_y,
                                      const float* high_y, const float* low_z, const float* high_z,
                                      int64_t blocks, float qx, float qy, float qz, float* bound) {
  for (int64_t b = 0; b < blocks; ++b) {
    const float dx = std::max(std::max(low_x[b] - qx, qx - high_x[b]), 0.0f);
    const float dy = std::max(std::max(low_y[b] - qy, qy - high_y[b]), 0.0f);
    const float dz = std::max(std::max(low_z[b] - qz, qz - high_z[b]), 0.0f);
    bound[b] = dx * dx + dy * dy + dz * dz;
  }
}

// distance[i] = min(distance[i], |p_i - q|^2) over one block; returns the largest afterwards.
STANCE_MULTIVERSION float Relax(const float* x, const float* y, const float* z, float qx, float qy, float qz,
                                float* distance) {
  constexpr int kLanes = 16;  // independent maxima, so that the reduction vectorises without -ffast-math
  float largest[kLanes] = {};
  for (int64_t i = 0; i < kBlock; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float dx = x[i + lane] - qx, dy = y[i + lane] - qy, dz = z[i + lane] - qz;
      const float d = dx * dx + dy * dy + dz * dz;
      const float least = d < distance[i + lane] ? d : distance[i + lane];
      distance[i + lane] = least;
      largest[lane] = least > largest[lane] ? least : largest[lane];
    }
  }
  return *std::max_element(largest, largest + kLanes);
}

}  // namespace

std::vector<int32_t> FarthestPoints(const Points& points, int64_t count) {
  const int64_t n = points.rows();
  std::vector<int32_t> chosen;
  if (n == 0 || count <= 0) return chosen;
  const Eigen::RowVector3f centroid = points.cast<double>().colwise().mean().cast<float>();
  Eigen::Index next;
  (points.rowwise() - centroid).rowwise().squaredNorm().maxCoeff(&next);
  const std::vector<int32_t> order = MortonOrder(points);
  Blocks blocks(points, order);
  const auto block_count = std::ssize(blocks.largest);
  std::vector<float> bound(blocks.largest.size());
  chosen.reserve(std::min(n, count));
  while (static_cast<int64_t>(chosen.size()) < std::min(n, count)) {
    chosen.push_back(static_cast<int32_t>(next));
    const float qx = points(next, 0), qy = points(next, 1), qz = points(next, 2);
    BoxDistances(blocks.low[0].data(), blocks.high[0].data(), blocks.low[1].data(), blocks.high[1].data(),
                 blocks.low[2].data(), blocks.high[2].data(), block_count, qx, qy, qz, bound.data());
    constexpr float kRounding = 0.9999f;  // the bound's and a row's distance round differently
    for (int64_t b = 0; b < block_count; ++b) {
      if (kRounding * bound[b] >= blocks.largest[b]) continue;
      const int64_t row = b * kBlock;
      blocks.largest[b] =
          Relax(&blocks.x[row], &blocks.y[row], &blocks.z[row], qx, qy, qz, &blocks.distance[row]);
    }
    const float farthest = *std::max_element(blocks.largest.begin(), blocks.largest.end());
    if (!(farthest > 0)) break;
    next = n;  // of rows that are equally far, the first
    for (int64_t b = 0; b < block_count; ++b) {
      if (blocks.largest[b] < farthest) continue;
      for (int64_t i = b * kBlock; i < (b + 1) * kBlock; ++i) {
        if (blocks.distance[i] == farthest) next = std::min<int64_t>(next, order[std::min(i, n - 1)]);
      }
    }
  }
  return chosen;
}

}  // namespace stance
