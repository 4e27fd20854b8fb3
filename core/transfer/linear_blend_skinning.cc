#include "core/transfer/linear_blend_skinning.h"

#include "core/base/check.h"

namespace stance {
namespace {

// Row j: T_j's 3x4 matrix, row-major, translation in the last column.
RowMatrix FlattenTransforms(std::span<const AffineTransform> transforms) {
  RowMatrix flat(static_cast<int64_t>(transforms.size()), 12);
  for (size_t j = 0; j < transforms.size(); ++j) {
    for (int row = 0; row < 3; ++row) {
      flat.block<1, 3>(static_cast<int64_t>(j), row * 4) = transforms[j].linear.row(row);
      flat(static_cast<int64_t>(j), row * 4 + 3) = transforms[j].translation[row];
    }
  }
  return flat;
}

}  // namespace

Points LinearBlendSkinning::Deform(const Points& vertices, const RowMatrix& weights,
                                   std::span<const AffineTransform> transforms) const {
  STANCE_CHECK(weights.rows() == vertices.rows());
  STANCE_CHECK(weights.cols() == static_cast<int64_t>(transforms.size()));
  const RowMatrix blended = weights * FlattenTransforms(transforms);  // (V, 12)
  Points out(vertices.rows(), 3);
  for (int64_t v = 0; v < vertices.rows(); ++v) {
    const Eigen::Map<const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> matrix(blended.row(v).data());
    out.row(v) = (matrix.leftCols<3>() * vertices.row(v).transpose() + matrix.col(3)).transpose();
  }
  return out;
}

Points DeformNormals(const Points& normals, const RowMatrix& weights,
                     std::span<const AffineTransform> transforms) {
  const RowMatrix blended = weights * FlattenTransforms(transforms);
  Points out(normals.rows(), 3);
  for (int64_t v = 0; v < normals.rows(); ++v) {
    const Eigen::Map<const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> matrix(blended.row(v).data());
    out.row(v) = (matrix.leftCols<3>() * normals.row(v).transpose()).transpose();
    const float norm = out.row(v).norm();
    if (norm > 0) out.row(v) /= norm;
  }
  return out;
}

}  // namespace stance
