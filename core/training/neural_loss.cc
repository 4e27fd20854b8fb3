#include "core/training/neural_loss.h"

namespace stance {

torch::Tensor SparseWeightLoss(const torch::Tensor& weights, const torch::Tensor& truth) {
  constexpr double kTiny = 1e-10;  // the paper's epsilon
  const auto terms = torch::xlogy(truth, truth) - truth * (weights + kTiny).log();
  return (terms * (weights > 0)).mean();
}

torch::Tensor EdgeLengthLoss(const torch::Tensor& points, const torch::Tensor& truth,
                             const torch::Tensor& edges) {
  const auto from = edges.select(1, 0), to = edges.select(1, 1);
  const auto lengths = [&](const torch::Tensor& places) {
    constexpr double kTiny = 1e-12;  // keeps the gradient of the length finite
    const auto edge = places.index_select(0, to) - places.index_select(0, from);
    return (edge.square().sum(1) + kTiny).sqrt();
  };
  return (lengths(points) - lengths(truth)).square().mean();
}

}  // namespace stance
