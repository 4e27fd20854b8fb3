#include "core/network/product.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

struct Result {
  torch::Tensor y, for_x, for_w;
};

Result ProductAndGradients(bool bfloat16) {
  torch::manual_seed(6);
  const auto x = torch::randn({50, 40}).requires_grad_(), w = torch::randn({30, 40}).requires_grad_();
  const auto upstream = torch::randn({50, 30});
  const Bfloat16Products scope(bfloat16);
  const auto y = Product(x, w);
  (y * upstream).sum().backward();
  return {y.detach(), x.grad(), w.grad()};
}

float RelativeDifference(const torch::Tensor& a, const torch::Tensor& b) {
  return ((a - b).norm() / b.norm()).item<float>();
}

TEST(Product, IsThatOfTheTransposedWeights) {
  torch::manual_seed(6);
  const auto x = torch::randn({50, 40}), w = torch::randn({30, 40});
  EXPECT_TRUE(Product(x, w).equal(torch::mm(x, w.t())));
}

TEST(Product, InBfloat16IsThatInFloat32Rounded) {
  const Result half = ProductAndGradients(true), full = ProductAndGradients(false);
  for (const auto& [a, b] : {std::pair{half.y, full.y}, {half.for_x, full.for_x}, {half.for_w, full.for_w}}) {
    EXPECT_EQ(a.scalar_type(), torch::kFloat32);
    const float difference = RelativeDifference(a, b);
    EXPECT_GT(difference, 1e-5f);  // it was rounded
    EXPECT_LT(difference, 1e-2f);
  }
}

TEST(Bfloat16Products, EndWithTheScope) {
  torch::manual_seed(6);
  const auto x = torch::randn({50, 40}), w = torch::randn({30, 40});
  const auto full = Product(x, w);
  {
    const Bfloat16Products on(true);
    EXPECT_FALSE(Product(x, w).equal(full));
    const Bfloat16Products off(false);
    EXPECT_TRUE(Product(x, w).equal(full));
  }
  EXPECT_TRUE(Product(x, w).equal(full));
}

}  // namespace
}  // namespace stance
