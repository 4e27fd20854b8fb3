#include "core/network/skeleton_edge_conv.h"

#include <gtest/gtest.h>

#include "core/skeleton/skeleton.h"

namespace stance {
namespace {

// The joints whose output changes with the input of `joint`.
std::vector<int> Reached(SkeletonEdgeConv& layers, int joint) {
  const torch::NoGradGuard no_grad;
  const auto x = torch::randn({1, kHumanJoints, 7});
  auto moved = x.clone();
  moved[0][joint] += 1;
  const auto change = (layers(moved) - layers(x)).abs().sum(2)[0];
  std::vector<int> reached;
  for (int j = 0; j < kHumanJoints; ++j) {
    if (change[j].item<float>() > 1e-4) reached.push_back(j);
  }
  return reached;
}

TEST(SkeletonEdgeConv, EachLayerReachesOneBoneFurther) {
  torch::manual_seed(1);
  SkeletonEdgeConv one(7, std::vector<int64_t>{33}), two(7, std::vector<int64_t>{33, 9});
  EXPECT_EQ(Reached(one, kLeftWrist), (std::vector<int>{kLeftElbow, kLeftWrist, kLeftHand}));
  EXPECT_EQ(Reached(two, kLeftWrist), (std::vector<int>{kLeftShoulder, kLeftElbow, kLeftWrist, kLeftHand}));
  EXPECT_EQ(Reached(one, kHead), (std::vector<int>{kNeck, kHead}));
}

TEST(SkeletonEdgeConv, ConcatenatesItsLayersAndKeepsSkeletonsApart) {
  torch::manual_seed(2);
  SkeletonEdgeConv layers(7, std::vector<int64_t>{33, 9});
  const auto x = torch::randn({3, kHumanJoints, 7}), out = layers(x);
  EXPECT_EQ(out.sizes(), (std::vector<int64_t>{3, kHumanJoints, 42}));
  for (int64_t i = 0; i < 3; ++i) {
    EXPECT_LT((out.slice(0, i, i + 1) - layers(x.slice(0, i, i + 1))).abs().max().item<float>(), 1e-5);
  }
}

}  // namespace
}  // namespace stance
