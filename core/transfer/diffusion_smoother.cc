#include "core/transfer/diffusion_smoother.h"

#include <algorithm>

#include "core/mesh/laplacian.h"
#include "core/mesh/measure.h"
#include "core/transfer/weight_solve.h"

namespace stance {

absl::StatusOr<RowMatrix> DiffusionSmoother::Smooth(const TriangleMesh& mesh, const Rig& rig) const {
  const SparseMatrix laplacian = CotangentLaplacian(mesh.positions, mesh.faces);
  Eigen::VectorXd mass;
  double step = 0;
  if (options_.kind == SmoothingKind::kHopwise) {
    mass = laplacian.diagonal();
    step = options_.lambda;
  } else {
    mass = VertexAreas(mesh.positions, mesh.faces);
    step = std::pow(options_.length * EstimateStature(mesh.positions, mesh.faces), 2);
  }
  // A vertex of no area (unreferenced, or all its faces degenerate) still needs a positive pivot. Relative to
  // the mean, so small that such a vertex takes its neighbours' weights.
  const double least = std::max(1e-9 * mass.mean(), 1e-30);
  mass = mass.cwiseMax(least);
  SparseMatrix system = step * laplacian;
  for (int64_t v = 0; v < system.cols(); ++v) system.coeffRef(v, v) += mass[v];
  const Eigen::MatrixXd right = mass.asDiagonal() * rig.weights.cast<double>();
  return SolveWeights(system, right, rig.weights);
}

std::unique_ptr<WeightSmoother> MakeSmoother(const SmoothingOptions& options) {
  if (options.kind == SmoothingKind::kNone) return std::make_unique<NoSmoother>();
  return std::make_unique<DiffusionSmoother>(options);
}

void LimitInfluences(RowMatrix& weights, int max_influences) {
  if (max_influences <= 0 || max_influences >= weights.cols()) return;
  std::vector<float> row(weights.cols());
  for (int64_t v = 0; v < weights.rows(); ++v) {
    std::copy(weights.row(v).data(), weights.row(v).data() + weights.cols(), row.begin());
    std::nth_element(row.begin(), row.begin() + max_influences - 1, row.end(), std::greater<>());
    const float least = row[max_influences - 1];
    // Ties at the threshold are kept in joint order until the places are full.
    int places = max_influences;
    for (int64_t j = 0; j < weights.cols(); ++j) places -= weights(v, j) > least;
    float sum = 0;
    for (int64_t j = 0; j < weights.cols(); ++j) {
      float& weight = weights(v, j);
      if (weight < least || (weight == least && places-- <= 0)) weight = 0;
      sum += weight;
    }
    if (sum > 0) weights.row(v) /= sum;
  }
}

}  // namespace stance
