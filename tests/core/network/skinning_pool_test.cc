#include "core/network/skinning_pool.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

TEST(SkinningPool, IsTheWeightedMeanAndZeroWithoutVertices) {
  const auto features = torch::tensor({{1.0f, 10.0f}, {3.0f, 30.0f}, {5.0f, 50.0f}});
  const auto weights = torch::tensor({{1.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}});
  const auto pooled = SkinningPool(features, weights, {0, 3});
  EXPECT_TRUE(pooled.allclose(torch::tensor({{{2.0f, 20.0f}, {5.0f, 50.0f}, {0.0f, 0.0f}}})));
}

TEST(SkinningUnpool, BlendsTheLatentsOfTheOwnMesh) {
  const auto latents = torch::tensor({{{1.0f, 2.0f}, {3.0f, 6.0f}}, {{-1.0f, 0.0f}, {0.0f, 8.0f}}});
  const auto weights = torch::tensor({{0.5f, 0.5f}, {1.0f, 0.0f}, {0.25f, 0.75f}});
  EXPECT_TRUE(SkinningUnpool(latents, weights, {0, 2, 3})
                  .allclose(torch::tensor({{2.0f, 4.0f}, {1.0f, 2.0f}, {-0.25f, 6.0f}})));
}

TEST(SkinningUnpool, OfRigidWeightsIsUndoneByPooling) {
  torch::manual_seed(1);
  const auto joint_of = torch::cat({torch::randperm(6, torch::kInt64), torch::randint(6, {30}, torch::kInt64),
                                    torch::randperm(6, torch::kInt64)});
  const auto weights = torch::one_hot(joint_of, 6).to(torch::kFloat32);
  const auto latents = torch::randn({2, 6, 5});
  const std::vector<int64_t> offsets = {0, 20, 42};
  const auto back = SkinningPool(SkinningUnpool(latents, weights, offsets), weights, offsets);
  const auto bound = torch::stack({weights.slice(0, 0, 20).sum(0), weights.slice(0, 20).sum(0)}) > 0;
  EXPECT_TRUE((back * bound.unsqueeze(2)).allclose(latents * bound.unsqueeze(2), 1e-5, 1e-5));
}

}  // namespace
}  // namespace stance
