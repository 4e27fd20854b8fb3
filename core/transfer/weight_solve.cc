#include "core/transfer/weight_solve.h"

#include <Eigen/SparseCholesky>
#include <vector>

namespace stance {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// a += factor * b, over `columns` numbers.
void AddScaled(double* a, double factor, const double* b, int64_t columns) {
  for (int64_t c = 0; c < columns; ++c) a[c] += factor * b[c];
}

// The solution for all columns of `right` at once. Eigen solves them one by one, each time reading a factor
// that is far larger than the caches; here each of its entries meets whole rows.
Rows Solve(const Eigen::SimplicialLDLT<SparseMatrix>& factor, const Rows& right) {
  using Entry = SparseMatrix::InnerIterator;
  const auto& lower = factor.matrixL().nestedExpression();
  const auto& diagonal = factor.vectorD();
  const int64_t columns = right.cols();
  Rows x = factor.permutationP() * right;
  for (Eigen::Index j = 0; j < lower.cols(); ++j) {
    for (Entry entry(lower, j); entry; ++entry) {
      if (entry.row() != j) AddScaled(x.row(entry.row()).data(), -entry.value(), x.row(j).data(), columns);
    }
  }
  x.array().colwise() /= diagonal.array();
  for (Eigen::Index j = lower.cols() - 1; j >= 0; --j) {
    for (Entry entry(lower, j); entry; ++entry) {
      if (entry.row() != j) AddScaled(x.row(j).data(), -entry.value(), x.row(entry.row()).data(), columns);
    }
  }
  return factor.permutationPinv() * x;
}

}  // namespace

absl::StatusOr<RowMatrix> SolveWeights(const SparseMatrix& system, const Eigen::MatrixXd& right,
                                       const RowMatrix& fallback) {
  const Eigen::SimplicialLDLT<SparseMatrix> factor(system);
  if (factor.info() != Eigen::Success) return absl::InternalError("weights: the matrix does not factor");
  std::vector<int64_t> active;
  for (int64_t j = 0; j < right.cols(); ++j) {
    if (right.col(j).maxCoeff() > 0) active.push_back(j);
  }
  Rows columns(right.rows(), std::ssize(active));
  for (int64_t i = 0; i < columns.cols(); ++i) columns.col(i) = right.col(active[i]);
  const Rows solved = Solve(factor, columns);
  if (!solved.allFinite()) return absl::InternalError("weights: the solve failed");
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
