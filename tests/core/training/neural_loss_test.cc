#include "core/training/neural_loss.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/network/sparse_softmax.h"

namespace stance {
namespace {

TEST(SparseWeightLoss, IsTheDivergenceOverTheJointsThatStay) {
  const auto weights = torch::tensor({{0.5f, 0.5f, 0.f}, {0.25f, 0.75f, 0.f}});
  const auto truth = torch::tensor({{0.25f, 0.75f, 0.f}, {0.5f, 0.f, 0.5f}});
  const double expected =
      (0.25 * std::log(0.25 / 0.5) + 0.75 * std::log(0.75 / 0.5) + 0.5 * std::log(0.5 / 0.25)) / 6;
  EXPECT_NEAR(SparseWeightLoss(weights, truth).item<double>(), expected, 1e-6);
  EXPECT_NEAR(SparseWeightLoss(weights, weights).item<double>(), 0, 1e-6);
}

TEST(SparseWeightLoss, IsLeastAtTheTruth) {
  torch::manual_seed(1);
  const auto logits = torch::randn({40, 24}).requires_grad_();
  const auto truth = SparseSoftmax(logits).detach();
  const auto loss = SparseWeightLoss(SparseSoftmax(logits), truth);
  loss.backward();
  EXPECT_LT(logits.grad().abs().max().item<float>(), 1e-6);
  // Of those weights that keep the true joints.
  for (int i = 0; i < 10; ++i) {
    const auto other =
        SparseSoftmax(logits.detach().masked_fill(truth == 0, -50) + 0.5 * torch::randn({40, 24}));
    EXPECT_GT(SparseWeightLoss(other, truth).item<float>(), loss.item<float>());
  }
}

TEST(SparseWeightLoss, GradientsEqualFiniteDifferences) {
  torch::manual_seed(2);
  const auto logits =
      torch::stack({0.2 * torch::randperm(24, torch::kFloat32), 0.2 * torch::randperm(24, torch::kFloat32)})
          .requires_grad_();
  const auto truth = torch::softmax(torch::randn({2, 24}), 1);
  SparseWeightLoss(SparseSoftmax(logits), truth).backward();
  const torch::NoGradGuard no_grad;
  constexpr double kStep = 0.05;  // too short to change which joints stay
  for (int64_t j = 0; j < 24; ++j) {
    const auto step = torch::zeros({2, 24});
    step[1][j] = kStep;
    const double change = ((SparseWeightLoss(SparseSoftmax(logits + step), truth) -
                            SparseWeightLoss(SparseSoftmax(logits - step), truth)) /
                           (2 * kStep))
                              .item<double>();
    EXPECT_NEAR(logits.grad()[1][j].item<double>(), change, 1e-5) << j;
  }
}

TEST(EdgeLengthLoss, IsOfLengthsAlone) {
  torch::manual_seed(3);
  const auto truth = torch::randn({20, 3});
  const auto edges = torch::tensor({{0, 1}, {1, 2}, {5, 19}}, torch::kInt64);
  const auto quarter = torch::tensor({{0.f, -1.f, 0.f}, {1.f, 0.f, 0.f}, {0.f, 0.f, 1.f}});
  EXPECT_NEAR(EdgeLengthLoss(torch::mm(truth, quarter) + 3, truth, edges).item<double>(), 0, 1e-9);
  const auto lengths =
      (truth.index_select(0, edges.select(1, 0)) - truth.index_select(0, edges.select(1, 1))).norm(2, 1);
  EXPECT_NEAR(EdgeLengthLoss(2 * truth, truth, edges).item<double>(), lengths.square().mean().item<double>(),
              1e-4);
}

TEST(EdgeLengthLoss, HasAGradientWhereAnEdgeHasNoLength) {
  const auto points = torch::zeros({2, 3}).requires_grad_();
  EdgeLengthLoss(points, torch::randn({2, 3}), torch::tensor({{0, 1}}, torch::kInt64)).backward();
  EXPECT_TRUE(points.grad().isfinite().all().item<bool>());
}

}  // namespace
}  // namespace stance
