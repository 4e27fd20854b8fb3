#include "core/network/edge_conv.h"

#include <gtest/gtest.h>

#include "core/network/skeletal_networks.h"

namespace stance {
namespace {

// Random weights, random running statistics, and BN scales of either sign.
void Randomize(torch::nn::Module& module) {
  torch::NoGradGuard no_grad;
  for (auto& item : module.named_parameters()) {
    if (item.key().find("norm.weight") != std::string::npos) item.value().uniform_(-1.5, 1.5);
    if (item.key().find("bias") != std::string::npos) item.value().normal_(0, 0.3);
  }
  for (auto& item : module.named_buffers()) {
    if (item.key().find("running_mean") != std::string::npos) item.value().normal_(0, 0.5);
    if (item.key().find("running_var") != std::string::npos) item.value().uniform_(0.3, 3);
  }
}

torch::Tensor RandomTable(int64_t rows, int64_t k) { return torch::randint(rows, {rows, k}, torch::kInt32); }

TEST(EdgeConv, DecompositionEqualsThePlainFormulation) {
  for (const bool batch_norm : {true, false}) {
    torch::manual_seed(batch_norm);
    EdgeConv layer(9, 33, batch_norm);
    Randomize(*layer);
    layer->eval();
    const auto x = torch::randn({400, 9}), table = RandomTable(400, 20);
    const auto fast = layer(x, table), plain = layer->ForwardPlain(x, table);
    EXPECT_LT((fast - plain).abs().max().item<float>(), 1e-4);
    EXPECT_GT(plain.std().item<float>(), 0.1);  // not trivially equal
  }
}

TEST(GkEdgeConv, DecompositionEqualsThePlainFormulation) {
  torch::manual_seed(5);
  GkEdgeConv layer(64, 128, true);
  Randomize(*layer);
  layer->eval();
  const auto x = torch::randn({300, 64}), knn = RandomTable(300, 20), ring = RandomTable(300, 9);
  EXPECT_LT((layer(x, knn, ring) - layer->ForwardPlain(x, knn, ring)).abs().max().item<float>(), 1e-4);
}

TEST(EdgeConv, TrainingUsesTheStatisticsOfAllEdges) {
  torch::manual_seed(6);
  EdgeConv layer(5, 16, true);
  Randomize(*layer);
  layer->train();
  const auto x = torch::randn({200, 5}), table = RandomTable(200, 8);
  // Plain: build every edge, normalise the batch of edges, then take the maximum.
  const auto u = x.index_select(0, table.reshape({-1}).to(torch::kInt64));
  const auto v = x.unsqueeze(1).expand({200, 8, 5}).reshape({-1, 5});
  const auto edges = torch::mm(torch::cat({u - v, v}, 1), layer->weight.t());
  torch::nn::BatchNorm1d norm(16);
  norm->weight.set_data(layer->norm->weight.detach().clone());
  norm->bias.set_data(layer->norm->bias.detach().clone());
  norm->running_mean.copy_(layer->norm->running_mean);
  norm->running_var.copy_(layer->norm->running_var);
  const auto plain = std::get<0>(torch::leaky_relu(norm(edges), kLeakySlope).reshape({200, 8, 16}).max(1));
  const auto fast = layer(x, table);
  EXPECT_LT((fast - plain).abs().max().item<float>(), 1e-4);
  EXPECT_LT((layer->norm->running_mean - norm->running_mean).abs().max().item<float>(), 1e-5);
  EXPECT_LT((layer->norm->running_var - norm->running_var).abs().max().item<float>(), 1e-4);
}

TEST(EdgeConv, TrainingGradientsEqualThoseOfThePlainFormulation) {
  torch::manual_seed(7);
  EdgeConv layer(5, 16, true);
  layer->train();
  const auto table = RandomTable(200, 8);
  const auto x = torch::randn({200, 5}).requires_grad_(), y = x.detach().clone().requires_grad_();
  const auto upstream = torch::randn({200, 16});
  (layer(x, table) * upstream).sum().backward();
  const auto weight_gradient = layer->weight.grad().clone();
  layer->zero_grad();
  const auto u = y.index_select(0, table.reshape({-1}).to(torch::kInt64));
  const auto v = y.unsqueeze(1).expand({200, 8, 5}).reshape({-1, 5});
  const auto edges = torch::mm(torch::cat({u - v, v}, 1), layer->weight.t());
  const auto plain = torch::leaky_relu(layer->norm(edges), kLeakySlope).reshape({200, 8, 16});
  (std::get<0>(plain.max(1)) * upstream).sum().backward();
  EXPECT_LT((x.grad() - y.grad()).abs().max().item<float>(), 1e-3);
  EXPECT_LT((weight_gradient - layer->weight.grad()).abs().max().item<float>(), 1e-2);
}

TEST(LinearNorm, SplitEqualsWhole) {
  torch::manual_seed(8);
  LinearNorm layer(12 + 5, 20, true);
  Randomize(*layer);
  const auto x = torch::randn({30, 12}), per_mesh = torch::randn({2, 5});
  const auto mesh = torch::cat({torch::zeros({10}), torch::ones({20})}).to(torch::kInt64);
  const auto whole = torch::cat({x, per_mesh.index_select(0, mesh)}, 1);
  layer->eval();
  EXPECT_LT((layer->ForwardSplit(x, per_mesh, mesh) - layer(whole)).abs().max().item<float>(), 1e-5);
  layer->train();
  const auto split = layer->ForwardSplit(x, per_mesh, mesh);
  EXPECT_LT((split - layer(whole)).abs().max().item<float>(), 1e-4);
}

TEST(LinearNorm, FoldedNormEqualsNorm) {
  torch::manual_seed(9);
  LinearNorm layer(12, 20, true);
  Randomize(*layer);
  layer->eval();
  const auto x = torch::randn({30, 12});
  const auto plain = torch::leaky_relu(layer->norm(torch::mm(x, layer->weight.t())), kLeakySlope);
  EXPECT_LT((layer(x) - plain).abs().max().item<float>(), 1e-5);
}

}  // namespace
}  // namespace stance
