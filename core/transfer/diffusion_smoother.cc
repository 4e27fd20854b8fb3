#include "core/transfer/diffusion_smoother.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "core/mesh/laplacian.h"
#include "core/mesh/measure.h"

namespace stance {

absl::StatusOr<RowMatrix> DiffusionSmoother::Smooth(const TriangleMesh& mesh,
                                                    const RowMatrix& weights) const {
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
  Eigen::SimplicialLDLT<SparseMatrix> factor(system);
  if (factor.info() != Eigen::Success)
    return absl::InternalError("weights: the diffusion matrix does not factor");

  // Joints that no vertex is bound to stay zero.
  std::vector<int64_t> active;
  for (int64_t j = 0; j < weights.cols(); ++j) {
    if (weights.col(j).maxCoeff() > 0) active.push_back(j);
  }
  Eigen::MatrixXd right(weights.rows(), static_cast<int64_t>(active.size()));
  for (size_t i = 0; i < active.size(); ++i) {
    right.col(static_cast<int64_t>(i)) = mass.cwiseProduct(weights.col(active[i]).cast<double>());
  }
  const Eigen::MatrixXd solved = factor.solve(right);
  if (factor.info() != Eigen::Success || !solved.allFinite()) {
    return absl::InternalError("weights: the diffusion solve failed");
  }
  RowMatrix smooth = RowMatrix::Zero(weights.rows(), weights.cols());
  for (int64_t v = 0; v < smooth.rows(); ++v) {
    // Rounding alone takes a row off [0, 1] and off the sum 1.
    const Eigen::RowVectorXd row = solved.row(v).cwiseMax(0.0);
    const double sum = row.sum();
    for (size_t i = 0; i < active.size(); ++i) {
      smooth(v, active[i]) =
          sum > 0 ? static_cast<float>(row[static_cast<int64_t>(i)] / sum) : weights(v, active[i]);
    }
  }
  return smooth;
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
