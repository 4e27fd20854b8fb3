#include "core/mesh/measure.h"

#include <Eigen/Geometry>
#include <cmath>

namespace stance {
namespace {

// Twice the face's area vector.
Eigen::Vector3d AreaVector(const Points& positions, const Faces& faces, int64_t f) {
  const Eigen::Vector3d a = positions.row(faces(f, 0)).cast<double>();
  const Eigen::Vector3d b = positions.row(faces(f, 1)).cast<double>();
  const Eigen::Vector3d c = positions.row(faces(f, 2)).cast<double>();
  return (b - a).cross(c - a);
}

}  // namespace

double SurfaceArea(const Points& positions, const Faces& faces) {
  double area = 0;
  for (int64_t f = 0; f < faces.rows(); ++f) area += 0.5 * AreaVector(positions, faces, f).norm();
  return area;
}

Eigen::VectorXd VertexAreas(const Points& positions, const Faces& faces) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(positions.rows());
  for (int64_t f = 0; f < faces.rows(); ++f) {
    const double third = AreaVector(positions, faces, f).norm() / 6;
    for (int corner = 0; corner < 3; ++corner) areas[faces(f, corner)] += third;
  }
  return areas;
}

double EstimateStature(const Points& positions, const Faces& faces) {
  constexpr double kStaturePerRootArea = 1.22;
  return kStaturePerRootArea * std::sqrt(SurfaceArea(positions, faces));
}

Points VertexNormals(const Points& positions, const Faces& faces) {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> sums(positions.rows(), 3);
  sums.setZero();
  for (int64_t f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d normal = AreaVector(positions, faces, f).transpose();
    for (int corner = 0; corner < 3; ++corner) sums.row(faces(f, corner)) += normal;
  }
  for (int64_t v = 0; v < sums.rows(); ++v) {
    const double norm = sums.row(v).norm();
    if (norm > 0) sums.row(v) /= norm;
  }
  return sums.cast<float>();
}

}  // namespace stance
