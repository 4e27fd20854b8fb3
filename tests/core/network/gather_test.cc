#include "core/network/gather.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

torch::Tensor RandomTable(int64_t rows, int64_t k, int64_t of) {
  return torch::randint(of, {rows, k}, torch::kInt32);
}

torch::Tensor Gathered(const torch::Tensor& x, const torch::Tensor& table) {
  return x.index_select(0, table.reshape({-1}).to(torch::kInt64)).reshape({table.size(0), table.size(1), -1});
}

TEST(GatherMax, IsTheMaximumOverNeighbours) {
  torch::manual_seed(1);
  const auto x = torch::randn({100, 37}), table = RandomTable(80, 7, 100);
  EXPECT_TRUE(GatherMax(x, table).equal(std::get<0>(Gathered(x, table).max(1))));
}

TEST(GatherSum, IsTheSumOverNeighbours) {
  torch::manual_seed(2);
  const auto x = torch::randn({100, 37}), table = RandomTable(80, 7, 100);
  EXPECT_LT((GatherSum(x, table) - Gathered(x, table).sum(1)).abs().max().item<float>(), 1e-5);
}

TEST(GatherWeighted, IsTheWeightedSumOverNeighboursAndSoIsItsGradient) {
  torch::manual_seed(4);
  const auto table = RandomTable(80, 3, 100);
  const auto weights = torch::rand({80, 3}), upstream = torch::randn({80, 37});
  const auto x = torch::randn({100, 37}).requires_grad_(), y = x.detach().clone().requires_grad_();
  const auto ours = GatherWeighted(x, table, weights);
  const auto plain = (Gathered(y, table) * weights.unsqueeze(2)).sum(1);
  EXPECT_LT((ours - plain).abs().max().item<float>(), 1e-5);
  (ours * upstream).sum().backward();
  (plain * upstream).sum().backward();
  EXPECT_LT((x.grad() - y.grad()).abs().max().item<float>(), 1e-5);
}

TEST(Gather, GradientsEqualThoseOfThePlainFormulation) {
  torch::manual_seed(3);
  const auto table = RandomTable(80, 7, 100);
  const auto upstream = torch::randn({80, 65});
  for (const bool maximum : {true, false}) {
    const auto x = torch::randn({100, 65}).requires_grad_(), y = x.detach().clone().requires_grad_();
    ((maximum ? GatherMax(x, table) : GatherSum(x, table)) * upstream).sum().backward();
    ((maximum ? std::get<0>(Gathered(y, table).max(1)) : Gathered(y, table).sum(1)) * upstream)
        .sum()
        .backward();
    EXPECT_LT((x.grad() - y.grad()).abs().max().item<float>(), 1e-5);
  }
}

}  // namespace
}  // namespace stance
