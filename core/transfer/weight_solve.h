// Linear systems whose unknowns are skinning weights.
#pragma once

#include "core/base/status.h"
#include "core/mesh/laplacian.h"

namespace stance {

// Solves system (V, V) * W = right (V, J) by sparse Cholesky, once for all columns, and makes weights of the
// solution: negative entries become 0, rows are scaled to sum to 1; a row of zeros takes `fallback`'s.
// Columns of zeros on the right stay zero. INTERNAL if the system does not factor. REQUIRES: `system` is
// symmetric positive definite.
absl::StatusOr<RowMatrix> SolveWeights(const SparseMatrix& system, const Eigen::MatrixXd& right,
                                       const RowMatrix& fallback);

}  // namespace stance
