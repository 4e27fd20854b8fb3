#include "core/transfer/weight_solve.h"

#include <Eigen/SparseCholesky>
#include <vector>

namespace stance {

absl::StatusOr<RowMatrix> SolveWeights(const SparseMatrix& system, const Eigen::MatrixXd& right,
                                       const RowMatrix& fallback) {
  const Eigen::SimplicialLDLT<SparseMatrix> factor(system);
  if (factor.info() != Eigen::Success) return absl::InternalError("weights: the matrix does not factor");
  std::vector<int64_t> active;
  for (int64_t j = 0; j < right.cols(); ++j) {
    if (right.col(j).maxCoeff() > 0) active.push_back(j);
  }
  Eigen::MatrixXd columns(right.rows(), std::ssize(active));
  for (int64_t i = 0; i < columns.cols(); ++i) columns.col(i) = right.col(active[i]);
  const Eigen::MatrixXd solved = factor.solve(columns);
  if (factor.info() != Eigen::Success || !solved.allFinite()) {
    return absl::InternalError("weights: the solve failed");
  }
  RowMatrix weights = RowMatrix::Zero(right.rows(), right.cols());
  for (int64_t v = 0; v < weights.rows(); ++v) {
    const Eigen::RowVectorXd row = solved.row(v).cwiseMax(0.0);
    const double sum = row.sum();
    if (!(sum > 0)) {
      weights.row(v) = fallback.row(v);
      continue;
    }
    for (int64_t i = 0; i < columns.cols(); ++i) weights(v, active[i]) = static_cast<float>(row[i] / sum);
  }
  return weights;
}

}  // namespace stance
