#include "core/mesh/laplacian.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

namespace stance {

SparseMatrix CotangentLaplacian(const Points& positions, const Faces& faces) {
  // cot 1 degree is 57: an angle below that is a sliver, and its true cotangent would tie two vertices so
  // tightly that the solve loses digits.
  constexpr double kMaxCotangent = 60.0;
  constexpr double kMinEdge = 1e-3;  // keeps obtuse edges connected
  const int64_t vertices = positions.rows();
  std::vector<Eigen::Triplet<double>> upper;
  upper.reserve(faces.size());
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int32_t a = faces(f, (corner + 1) % 3), b = faces(f, (corner + 2) % 3), c = faces(f, corner);
      if (a == b) continue;
      const Eigen::Vector3d u = (positions.row(a) - positions.row(c)).cast<double>();
      const Eigen::Vector3d w = (positions.row(b) - positions.row(c)).cast<double>();
      const double dot = u.dot(w), cross = u.cross(w).norm();
      double cotangent = 0;
      if (cross > 0) {
        cotangent = std::clamp(dot / cross, -kMaxCotangent, kMaxCotangent);
      } else if (dot > 0) {
        cotangent = kMaxCotangent;  // a collapsed triangle: the edge's ends coincide as seen from c
      }
      upper.emplace_back(std::min(a, b), std::max(a, b), 0.5 * cotangent);
    }
  }
  SparseMatrix edges(vertices, vertices);
  edges.setFromTriplets(upper.begin(), upper.end());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(edges.nonZeros() * 2 + vertices);
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(vertices);
  for (int64_t column = 0; column < edges.outerSize(); ++column) {
    for (SparseMatrix::InnerIterator it(edges, column); it; ++it) {
      const double weight = std::max(it.value(), kMinEdge);
      entries.emplace_back(it.row(), it.col(), -weight);
      entries.emplace_back(it.col(), it.row(), -weight);
      diagonal[it.row()] += weight;
      diagonal[it.col()] += weight;
    }
  }
  for (int64_t v = 0; v < vertices; ++v) entries.emplace_back(v, v, diagonal[v]);
  SparseMatrix laplacian(vertices, vertices);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  return laplacian;
}

}  // namespace stance
