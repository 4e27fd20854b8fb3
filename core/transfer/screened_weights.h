// Smooth weights for every vertex from those of surface samples.
#pragma once

#include "core/base/status.h"
#include "core/mesh/resample.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/parts.h"

namespace stance {

struct ScreeningOptions {
  // How much smoothness counts against the samples' own weights. The Dirichlet energy on a surface has no
  // unit, so neither vertex density nor scale matter.
  double smoothness = 0.5;
  // How much the weights of the sample along the surface (SurfaceSamples::cell) count: what decides where no
  // sample is near. On components without a sample, which have nothing else, they count in full (1). > 0.
  double prior = 1e-3;
};

// The W (V, J) that minimises |B W - S|^2 + smoothness tr(W^T L W) + prior |W - P|^2, clamped to be
// non-negative and with rows that sum to 1. B (N, V) interpolates at the samples' places, S (N, J) are the
// samples' weights, L is the cotangent Laplacian, P the samples' weights carried to their cells (the norm of
// the last is over the surface, with N for its area). One sparse Cholesky factorisation for all joints.
//
// Weights spread along the surface only: they do not bleed across a gap.
// INTERNAL if the factorisation fails. REQUIRES: `samples` were taken from `mesh`.
absl::StatusOr<RowMatrix> ScreenedWeights(const TriangleMesh& mesh, const SurfaceSamples& samples,
                                          const RowMatrix& sample_weights,
                                          const ScreeningOptions& options = {});

// ScreenedWeights of rig.sampled, which must be there.
class ScreenedSmoother : public WeightSmoother {
 public:
  explicit ScreenedSmoother(const ScreeningOptions& options = {}) : options_(options) {}

  absl::StatusOr<RowMatrix> Smooth(const TriangleMesh& mesh, const Rig& rig) const override;

 private:
  ScreeningOptions options_;
};

}  // namespace stance
