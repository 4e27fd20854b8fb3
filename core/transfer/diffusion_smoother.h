// Weights smoothed by one implicit step of the diffusion equation (paper A, section 3.3).
#pragma once

#include "core/transfer/options.h"
#include "core/transfer/parts.h"

namespace stance {

// kMetric solves (M + t L_c) W = M W_0 with lumped vertex areas M and t = (length * stature)^2: the same
// smoothing in metres whatever the vertex density. kHopwise solves (D + lambda L_c) W = D W_0, D the diagonal
// of L_c, which is the paper's (I - lambda L) with the row-normalised cotangent Laplacian: it smooths over a
// number of edges.
//
// One sparse Cholesky factorisation serves all joints. L_c is an M-matrix, so rows stay non-negative and sum
// to 1.
class DiffusionSmoother : public WeightSmoother {
 public:
  explicit DiffusionSmoother(const SmoothingOptions& options) : options_(options) {}

  // INTERNAL if the factorisation fails.
  absl::StatusOr<RowMatrix> Smooth(const TriangleMesh& mesh, const Rig& rig) const override;

 private:
  SmoothingOptions options_;
};

// Weights as they are (paper A's ablation).
class NoSmoother : public WeightSmoother {
 public:
  absl::StatusOr<RowMatrix> Smooth(const TriangleMesh&, const Rig& rig) const override { return rig.weights; }
};

std::unique_ptr<WeightSmoother> MakeSmoother(const SmoothingOptions& options);

// Keeps each row's `max_influences` largest weights and rescales them to sum 1; 0 keeps all.
void LimitInfluences(RowMatrix& weights, int max_influences);

}  // namespace stance
