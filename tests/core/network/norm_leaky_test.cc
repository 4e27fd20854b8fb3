#include "core/network/norm_leaky.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

constexpr double kSlope = 0.2;

float Difference(const torch::Tensor& a, const torch::Tensor& b) { return (a - b).abs().max().item<float>(); }

// A norm whose scales and shifts are not the initial ones; the same for the same seed.
torch::nn::BatchNorm1d Norm(int64_t channels) {
  torch::manual_seed(4);
  torch::nn::BatchNorm1d norm(channels);
  norm->weight.data().copy_(torch::randn({channels}));
  norm->bias.data().copy_(torch::randn({channels}));
  return norm;
}

class NormLeakyTest : public ::testing::TestWithParam<int64_t> {};  // channels

TEST_P(NormLeakyTest, EqualsTheTwoOperationsAndTheirGradients) {
  const int64_t channels = GetParam();
  torch::nn::BatchNorm1d fused = Norm(channels), plain = Norm(channels);
  const auto values = 3 * torch::randn({150, channels}) + 1;
  const auto upstream = torch::randn({150, channels});
  const auto x = values.clone().requires_grad_(), y = values.clone().requires_grad_();
  const auto a = NormLeaky(x, fused, kSlope), b = torch::leaky_relu(plain(y), kSlope);
  EXPECT_LT(Difference(a, b), 1e-4f);
  EXPECT_LT(Difference(fused->running_mean, plain->running_mean), 1e-5f);
  EXPECT_LT(Difference(fused->running_var, plain->running_var), 1e-4f);
  EXPECT_EQ(fused->num_batches_tracked.item<int64_t>(), 1);
  (a * upstream).sum().backward();
  (b * upstream).sum().backward();
  EXPECT_LT(Difference(x.grad(), y.grad()), 1e-4f);
  EXPECT_LT(Difference(fused->weight.grad(), plain->weight.grad()), 1e-3f);
  EXPECT_LT(Difference(fused->bias.grad(), plain->bias.grad()), 1e-3f);
}

INSTANTIATE_TEST_SUITE_P(Channels, NormLeakyTest, ::testing::Values(1, 7, 8, 37, 130));

TEST(NormLeaky, AConstantChannelGivesItsShift) {
  torch::nn::BatchNorm1d norm = Norm(3);
  const auto x = torch::full({40, 3}, 5.0f).requires_grad_();
  const auto y = NormLeaky(x, norm, kSlope);
  EXPECT_LT(Difference(y, torch::leaky_relu(norm->bias, kSlope).expand({40, 3})), 1e-3f);
  y.sum().backward();
  EXPECT_TRUE(x.grad().isfinite().all().item<bool>());
}

}  // namespace
}  // namespace stance
