#include "core/network/sparse_softmax.h"

#include <gtest/gtest.h>

#include <limits>

namespace stance {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// No two entries of a row are nearer than 0.1.
torch::Tensor DistinctLogits(int64_t rows, int64_t columns) {
  std::vector<torch::Tensor> logits;
  for (int64_t i = 0; i < rows; ++i) logits.push_back(0.1 * torch::randperm(columns, torch::kFloat32));
  return torch::stack(logits) - 1;
}

TEST(SparseSoftmax, IsTheSoftmaxOfTheKLargest) {
  torch::manual_seed(1);
  const auto logits = torch::randn({600, 24}), weights = SparseSoftmax(logits);
  const auto [values, indices] = logits.topk(4, 1);
  const auto expected = torch::zeros_like(logits).scatter_(1, indices, torch::softmax(values, 1));
  EXPECT_LT((weights - expected).abs().max().item<float>(), 1e-6);
  EXPECT_TRUE((weights > 0).sum(1).equal(torch::full({600}, 4, torch::kInt64)));
}

TEST(SparseSoftmax, OfAsManyAsThereAreIsTheSoftmax) {
  torch::manual_seed(2);
  const auto logits = torch::randn({50, 5});
  for (const int64_t k : {5, 9}) {
    EXPECT_LT((SparseSoftmax(logits, k) - torch::softmax(logits, 1)).abs().max().item<float>(), 1e-6);
  }
}

TEST(SparseSoftmax, GradientsEqualFiniteDifferences) {
  torch::manual_seed(3);
  constexpr double kStep = 0.02;  // too short to change which entries stay
  const auto logits = DistinctLogits(20, 24), upstream = torch::randn({20, 24});
  const auto x = logits.clone().requires_grad_();
  (SparseSoftmax(x) * upstream).sum().backward();
  for (int64_t j = 0; j < 24; ++j) {
    const auto step = torch::zeros({1, 24});
    step[0][j] = kStep;
    const auto change = (SparseSoftmax(logits + step) - SparseSoftmax(logits - step)) / (2 * kStep);
    EXPECT_LT((x.grad().select(1, j) - (change * upstream).sum(1)).abs().max().item<float>(), 1e-3) << j;
  }
}

TEST(SparseSoftmax, WhatIsLeftOutHasNoGradient) {
  torch::manual_seed(4);
  const auto x = DistinctLogits(30, 24).requires_grad_();
  const auto weights = SparseSoftmax(x);
  (weights * torch::randn({30, 24})).sum().backward();
  EXPECT_EQ(x.grad().masked_select(weights == 0).abs().max().item<float>(), 0);
  // Each row's gradient sums to zero, since its weights sum to one.
  EXPECT_LT(x.grad().sum(1).abs().max().item<float>(), 1e-5);
}

TEST(SparseSoftmax, TiesAtTheThresholdAllStay) {
  const auto logits = torch::tensor({{3.f, 1.f, 2.f, 1.f, 1.f, 0.f}, {0.f, 0.f, 0.f, 0.f, 0.f, 0.f}});
  const auto weights = SparseSoftmax(logits, 3);
  EXPECT_TRUE((weights > 0)
                  .equal(torch::tensor(
                      {{true, true, true, true, true, false}, {true, true, true, true, true, true}})));
  EXPECT_LT((weights.sum(1) - 1).abs().max().item<float>(), 1e-6);
  const auto order = torch::tensor({4, 2, 0, 5, 3, 1}, torch::kInt64);
  EXPECT_LT((SparseSoftmax(logits.index_select(1, order), 3) - weights.index_select(1, order))
                .abs()
                .max()
                .item<float>(),
            1e-6);
}

TEST(SparseSoftmax, IsDefinedWhateverTheLogits) {
  const auto few = SparseSoftmax(torch::tensor({{-kInfinity, 1.f, -kInfinity, 1.f, -kInfinity}}));
  EXPECT_LT((few - torch::tensor({{0.f, 0.5f, 0.f, 0.5f, 0.f}})).abs().max().item<float>(), 1e-6);
  EXPECT_EQ(SparseSoftmax(torch::full({1, 6}, -kInfinity)).abs().max().item<float>(), 0);
  // Far below where exp vanishes, and far above where it overflows.
  for (const float shift : {-500.f, 500.f}) {
    EXPECT_NEAR(SparseSoftmax(torch::randn({1, 24}) + shift).sum().item<float>(), 1, 1e-6);
  }
  EXPECT_TRUE(SparseSoftmax(torch::tensor({{1.f, std::nanf(""), 2.f}})).isnan().all().item<bool>());
}

}  // namespace
}  // namespace stance
