#include "core/transfer/screened_weights.h"

#include <algorithm>

#include "core/base/check.h"
#include "core/mesh/laplacian.h"
#include "core/mesh/measure.h"
#include "core/transfer/weight_solve.h"

namespace stance {

absl::StatusOr<RowMatrix> ScreenedWeights(const TriangleMesh& mesh, const SurfaceSamples& samples,
                                          const RowMatrix& sample_weights, const ScreeningOptions& options) {
  const int64_t n = std::ssize(samples.place), vertices = mesh.vertex_count();
  RowMatrix prior(vertices, sample_weights.cols());
  for (int64_t v = 0; v < vertices; ++v) prior.row(v) = sample_weights.row(samples.cell[v]);
  Eigen::VectorXd mass = VertexAreas(mesh.positions, mesh.faces);
  const double area = mass.sum();
  // A vertex of no area (unreferenced, or all its faces degenerate) still needs a positive pivot.
  mass = area > 0 ? Eigen::VectorXd(mass * (static_cast<double>(n) / area)) : Eigen::VectorXd::Ones(vertices);
  mass = options.prior * mass.cwiseMax(1e-6);
  // Else a strap over a bending back would take one mean of its weights all along.
  for (const int32_t v : samples.unreached) mass[v] /= options.prior;

  std::vector<Eigen::Triplet<double>> entries;
  for (int64_t v = 0; v < vertices; ++v) entries.emplace_back(v, v, mass[v]);
  Eigen::MatrixXd right = mass.asDiagonal() * prior.cast<double>();
  for (int64_t s = 0; s < n; ++s) {
    const SurfacePlace& place = samples.place[s];
    for (int i = 0; i < 3; ++i) {
      if (place.weight[i] == 0) continue;
      right.row(place.corner[i]) += place.weight[i] * sample_weights.row(s).cast<double>();
      for (int j = 0; j < 3; ++j) {
        const double product = static_cast<double>(place.weight[i]) * place.weight[j];
        if (product != 0) entries.emplace_back(place.corner[i], place.corner[j], product);
      }
    }
  }
  SparseMatrix data(vertices, vertices);
  data.setFromTriplets(entries.begin(), entries.end());
  const SparseMatrix system = data + options.smoothness * CotangentLaplacian(mesh.positions, mesh.faces);
  return SolveWeights(system, right, prior);
}

absl::StatusOr<RowMatrix> ScreenedSmoother::Smooth(const TriangleMesh& mesh, const Rig& rig) const {
  STANCE_CHECK(rig.sampled != nullptr);
  return ScreenedWeights(mesh, rig.sampled->samples, rig.sampled->weights, options_);
}

}  // namespace stance
