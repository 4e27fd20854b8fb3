#include "core/network/skeletal_networks.h"

#include <gtest/gtest.h>

#include "core/network/knn.h"

namespace stance {
namespace {

NetworkInput RandomInput(int64_t points, uint64_t seed) {
  torch::manual_seed(seed);
  NetworkInput input;
  const auto p = torch::randn({points, 3});
  input.points = Eigen::Map<const Points>(p.data_ptr<float>(), points, 3);
  input.one_ring.resize(points, 6);
  const auto ring = KNearest(p, {0, points}, 6);
  input.one_ring = Eigen::Map<const NeighborTable>(ring.data_ptr<int32_t>(), points, 6);
  return input;
}

PointBatch Stack(const std::vector<const NetworkInput*>& inputs) {
  PointBatch batch = StackInputs(inputs);
  AddSpatialNeighbors(batch);
  return batch;
}

TEST(SkeletalNetworks, HavePaperAsParameterCount) {
  EXPECT_EQ(ParameterCount(*WeightNetwork()), 339'328 + 231'936 + 1'793'176);
  EXPECT_EQ(ParameterCount(*JointNetwork()), 337'984 + 313'280 + 361'987);
  EXPECT_EQ(ParameterCount(*WeightNetwork()) + ParameterCount(*JointNetwork()), 3'377'691);
}

class TrainedLike : public ::testing::Test {
 protected:
  void SetUp() override {
    torch::manual_seed(11);
    weights_ = WeightNetwork();
    joints_ = JointNetwork();
    torch::NoGradGuard no_grad;
    for (auto& item : weights_->named_parameters()) {
      if (item.key().find("norm.weight") != std::string::npos) item.value().uniform_(-1.5, 1.5);
    }
    weights_->eval();
    joints_->eval();
  }
  torch::Tensor Logits(const PointBatch& batch) {
    torch::NoGradGuard no_grad;
    return weights_(batch);
  }
  torch::Tensor Joints(const PointBatch& batch, const torch::Tensor& w) {
    torch::NoGradGuard no_grad;
    return joints_(batch, w);
  }
  WeightNetwork weights_{nullptr};
  JointNetwork joints_{nullptr};
};

TEST_F(TrainedLike, EqualThePlainFormulation) {
  torch::NoGradGuard no_grad;
  const NetworkInput input = RandomInput(300, 1);
  const PointBatch batch = Stack({&input});
  const auto logits = weights_(batch);
  const float scale = logits.abs().max().item<float>();
  EXPECT_LT((logits - weights_->ForwardPlain(batch)).abs().max().item<float>(), 1e-4 * scale);
  const auto rigid = RigidWeights(logits);
  EXPECT_LT((joints_(batch, rigid) - joints_->ForwardPlain(batch, rigid)).abs().max().item<float>(), 1e-4);
}

TEST_F(TrainedLike, ABatchOfMixedSizesEqualsOneByOne) {
  const NetworkInput inputs[] = {RandomInput(120, 2), RandomInput(40, 3), RandomInput(333, 4)};
  const PointBatch batch = Stack({&inputs[0], &inputs[1], &inputs[2]});
  const auto logits = Logits(batch);
  const auto rigid = RigidWeights(logits);
  const auto joints = Joints(batch, rigid);
  for (int i = 0; i < 3; ++i) {
    const PointBatch alone = Stack({&inputs[i]});
    const auto expected = Logits(alone);
    const auto part = logits.slice(0, batch.offsets[i], batch.offsets[i + 1]);
    EXPECT_LT((part - expected).abs().max().item<float>(), 1e-4 * expected.abs().max().item<float>());
    const auto own = rigid.slice(0, batch.offsets[i], batch.offsets[i + 1]);
    EXPECT_LT((joints[i] - Joints(alone, own)[0]).abs().max().item<float>(), 1e-4);
  }
}

TEST_F(TrainedLike, DoNotDependOnTheOrderOfThePoints) {
  const NetworkInput input = RandomInput(200, 5);
  const auto order = torch::randperm(200, torch::kInt64);  // row i of the shuffled input is row order[i]
  const auto inverse = order.argsort();
  NetworkInput shuffled = input;
  for (int64_t i = 0; i < 200; ++i) {
    const int64_t from = order[i].item<int64_t>();
    shuffled.points.row(i) = input.points.row(from);
    for (int k = 0; k < 6; ++k) {
      shuffled.one_ring(i, k) = inverse[input.one_ring(from, k)].item<int>();
    }
  }
  const PointBatch a = Stack({&input}), b = Stack({&shuffled});
  const auto logits = Logits(a), other = Logits(b);
  EXPECT_LT((logits.index_select(0, order) - other).abs().max().item<float>(),
            1e-4 * logits.abs().max().item<float>());
  EXPECT_LT((Joints(a, RigidWeights(logits)) - Joints(b, RigidWeights(other))).abs().max().item<float>(),
            1e-4);
}

TEST_F(TrainedLike, RowsOfTheHeadEqualThoseOfTheWhole) {
  torch::NoGradGuard no_grad;
  const NetworkInput input = RandomInput(150, 6);
  const PointBatch batch = Stack({&input});
  const auto rows = torch::tensor({3, 77, 149}, torch::kInt64);
  EXPECT_LT(
      (weights_->ForwardRows(batch, rows) - weights_(batch).index_select(0, rows)).abs().max().item<float>(),
      1e-4);
}

TEST(RigidWeights, AreOneHotAtTheLargestLogit) {
  const auto logits = torch::randn({50, kHumanJoints});
  const auto rigid = RigidWeights(logits);
  EXPECT_TRUE(rigid.sum(1).equal(torch::ones({50})));
  EXPECT_TRUE(rigid.argmax(1).equal(logits.argmax(1)));
}

}  // namespace
}  // namespace stance
