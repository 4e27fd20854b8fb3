// The cotangent Laplacian.
#pragma once

#include <Eigen/SparseCore>

#include "core/base/types.h"

namespace stance {

using SparseMatrix = Eigen::SparseMatrix<double>;

// L_c (V, V), symmetric positive semi-definite, L_c 1 = 0:
// (L_c)_ij = -(cot a_ij + cot b_ij) / 2 on edges, the diagonal minus the row's sum.
//
// Cotangents of degenerate triangles are bounded, and an edge whose two cotangents sum to less than zero
// counts as nearly zero, so that L_c is an M-matrix: diffusion by it keeps the maximum principle, and weights
// stay in [0, 1]. Non-manifold edges sum over all their faces. Unreferenced vertices have empty rows.
SparseMatrix CotangentLaplacian(const Points& positions, const Faces& faces);

}  // namespace stance
