#include "core/training/weight_cleanup.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/skeleton/skeleton.h"

namespace stance {
namespace {

constexpr int kSmoothingSteps = 2;
constexpr float kSmallestWeight = 0.005f;

void NormalizeRows(RowMatrix& weights) {
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    const float sum = weights.row(v).sum();
    if (sum > 1e-6f) weights.row(v) /= sum;
  }
}

// For each vertex the one nearest to its mirror image in x: a sweep over the vertices sorted by height.
std::vector<int> MirrorVertices(const Points& vertices) {
  const auto count = static_cast<int>(vertices.rows());
  std::vector<int> by_height(count);
  std::iota(by_height.begin(), by_height.end(), 0);
  std::sort(by_height.begin(), by_height.end(),
            [&](int a, int b) { return vertices(a, 1) < vertices(b, 1); });
  std::vector<int> mirror(count);
  for (int i = 0; i < count; ++i) {
    const int v = by_height[i];
    const Eigen::RowVector3f image(-vertices(v, 0), vertices(v, 1), vertices(v, 2));
    float best = (vertices.row(v) - image).squaredNorm();
    mirror[v] = v;
    const auto visit = [&](int k) {  // false once every further vertex is too high or too low
      const int u = by_height[k];
      const float rise = vertices(u, 1) - image.y();
      if (rise * rise > best) return false;
      const float distance = (vertices.row(u) - image).squaredNorm();
      if (distance < best) {
        best = distance;
        mirror[v] = u;
      }
      return true;
    };
    for (int k = i + 1; k < count && visit(k); ++k) {
    }
    for (int k = i - 1; k >= 0 && visit(k); --k) {
    }
  }
  return mirror;
}

RowMatrix Symmetrized(const RowMatrix& weights, const std::vector<int>& mirror) {
  RowMatrix result(weights.rows(), weights.cols());
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    for (int j = 0; j < kHumanJoints; ++j) {
      result(v, j) = 0.5f * (weights(v, j) + weights(mirror[v], MirrorJoint(j)));
    }
  }
  return result;
}

RowMatrix Smoothed(const RowMatrix& weights, const Faces& faces) {
  // Each face contributes its edges once in each direction, so an interior edge counts twice on both ends:
  // the mean over the ring is unchanged.
  RowMatrix sum = RowMatrix::Zero(weights.rows(), weights.cols());
  Eigen::VectorXf degree = Eigen::VectorXf::Zero(weights.rows());
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = faces(f, c), b = faces(f, (c + 1) % 3);
      sum.row(a) += weights.row(b);
      sum.row(b) += weights.row(a);
      degree[a] += 1;
      degree[b] += 1;
    }
  }
  RowMatrix result = weights;
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    if (degree[v] > 0) result.row(v) = 0.5f * (weights.row(v) + sum.row(v) / degree[v]);
  }
  return result;
}

}  // namespace

RowMatrix CleanWeights(const RowMatrix& raw, const Points& vertices, const Faces& faces) {
  STANCE_CHECK(raw.rows() == vertices.rows() && raw.cols() == kHumanJoints);
  RowMatrix weights = raw;
  NormalizeRows(weights);
  weights = Symmetrized(weights, MirrorVertices(vertices));
  for (int step = 0; step < kSmoothingSteps; ++step) weights = Smoothed(weights, faces);
  NormalizeRows(weights);
  weights = (weights.array() < kSmallestWeight).select(0.0f, weights);
  NormalizeRows(weights);
  return weights;
}

}  // namespace stance
