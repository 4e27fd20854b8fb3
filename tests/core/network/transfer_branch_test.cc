// Both branches of METHOD_NEURAL: what holds of any weights.
#include "core/network/transfer_branch.h"

#include <gtest/gtest.h>

#include "core/mesh/resample.h"
#include "core/network/rigging_branch.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

NetworkInput InputOf(const TriangleMesh& mesh, int64_t samples) {
  SurfaceSamples surface = ResampleSurface(mesh, {samples, 12});
  return {std::move(surface.points), std::move(surface.one_ring)};
}

TriangleMesh Lopsided() {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.2f, 24, 6, 20);
  mesh.positions.col(0) += 0.2f * mesh.positions.col(1).cwiseAbs2() + 0.1f * mesh.positions.col(2);
  return mesh;
}

PointBatch BatchOf(const std::vector<NetworkInput>& inputs) {
  std::vector<const NetworkInput*> pointers;
  for (const NetworkInput& input : inputs) pointers.push_back(&input);
  PointBatch batch = StackInputs(pointers);
  AddSpatialNeighbors(batch);
  return batch;
}

float Difference(const torch::Tensor& a, const torch::Tensor& b) { return (a - b).abs().max().item<float>(); }

// Row i is row order[i] of the input.
NetworkInput Shuffled(const NetworkInput& input, const torch::Tensor& order) {
  const auto inverse = order.argsort();
  NetworkInput shuffled = input;
  for (int64_t i = 0; i < input.points.rows(); ++i) {
    const auto from = order[i].item<int64_t>();
    shuffled.points.row(i) = input.points.row(from);
    for (int64_t k = 0; k < input.one_ring.cols(); ++k) {
      shuffled.one_ring(i, k) = inverse[input.one_ring(from, k)].item<int>();
    }
  }
  return shuffled;
}

class NeuralBranchesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    torch::manual_seed(3);
    rigging_ = RiggingBranch();
    transfer_ = TransferBranch();
    rigging_->eval();
    transfer_->eval();
  }

  // V_t of each source, at its own samples.
  torch::Tensor Transfer(const std::vector<NetworkInput>& sources,
                         const std::vector<NetworkInput>& references) {
    const torch::NoGradGuard no_grad;
    const PointBatch source = BatchOf(sources), reference = BatchOf(references);
    const RiggingPrediction s = rigging_(source), r = rigging_(reference);
    const auto latents = transfer_->Latents(transfer_->Pool(source, s.weights),
                                            transfer_->Pool(reference, r.weights), s.joints, r.joints);
    return transfer_->Decode(latents, s.weights, source.points, source.offsets);
  }

  RiggingBranch rigging_{nullptr};
  TransferBranch transfer_{nullptr};
};

TEST_F(NeuralBranchesTest, HaveTheDocumentedParameterCount) {
  EXPECT_EQ(ParameterCount(*rigging_), 3'377'691);
  EXPECT_EQ(ParameterCount(*transfer_), 2'484'675);
}

TEST_F(NeuralBranchesTest, WeightsAreSparseAndSumToOne) {
  const torch::NoGradGuard no_grad;
  const RiggingPrediction rig = rigging_(BatchOf({InputOf(Lopsided(), 200)}));
  EXPECT_LT(Difference(rig.weights.sum(1), torch::ones({200})), 1e-5);
  EXPECT_GE(rig.weights.min().item<float>(), 0);
  EXPECT_LE((rig.weights > 0).sum(1).max().item<int64_t>(), 4);
  EXPECT_EQ(rig.joints.sizes(), (std::vector<int64_t>{1, kHumanJoints, 3}));
}

TEST_F(NeuralBranchesTest, JointsTeachTheWeights) {
  const RiggingPrediction rig = rigging_(BatchOf({InputOf(Lopsided(), 100)}));
  rig.joints.square().sum().backward();
  EXPECT_GT(rigging_->f_s->out->weight.grad().abs().max().item<float>(), 0);
}

TEST_F(NeuralBranchesTest, ABatchOfMixedSizesEqualsOneByOne) {
  const std::vector<NetworkInput> sources = {InputOf(Lopsided(), 150), InputOf(testing::Box(), 64),
                                             InputOf(testing::Icosphere(3), 100)};
  const std::vector<NetworkInput> references = {sources[2], sources[0], sources[1]};
  const auto together = Transfer(sources, references).split_with_sizes({150, 64, 100});
  for (size_t i = 0; i < sources.size(); ++i) {
    EXPECT_LT(Difference(together[i], Transfer({sources[i]}, {references[i]})), 1e-4) << i;
  }
}

TEST_F(NeuralBranchesTest, TheOrderOfTheSourcesPointsIsTheResultsAndTheReferencesIsNone) {
  TriangleMesh other_mesh = Lopsided();  // a symmetric one would have ties among its neighbours
  other_mesh.positions.col(2) += 0.3f * other_mesh.positions.col(1).cwiseAbs2();
  const NetworkInput source = InputOf(Lopsided(), 150), reference = InputOf(other_mesh, 100);
  const auto plain = Transfer({source}, {reference});
  const auto order = torch::randperm(150, torch::kInt64);
  EXPECT_LT(Difference(Transfer({Shuffled(source, order)}, {reference}), plain.index_select(0, order)), 1e-4);
  const auto other = torch::randperm(100, torch::kInt64);
  EXPECT_LT(Difference(Transfer({source}, {Shuffled(reference, other)}), plain), 1e-4);
}

TEST_F(NeuralBranchesTest, DecodingJointsFirstEqualsThePrintedFormula) {
  const torch::NoGradGuard no_grad;
  const auto latents = torch::randn({2, kHumanJoints, TransferBranchImpl::kLatent});
  const auto weights = torch::softmax(3 * torch::randn({1500, kHumanJoints}), 1);
  const auto points = torch::randn({1500, 3});
  const std::vector<int64_t> offsets = {0, 1100, 1500};  // one more than a block, and one less
  const auto plain = transfer_->DecodePlain(latents, weights, points, offsets);
  EXPECT_LT(Difference(transfer_->Decode(latents, weights, points, offsets), plain), 1e-4);
  EXPECT_GT(plain.std().item<float>(), 0.1);  // not trivially equal
  const torch::AutoGradMode gradient(true);
  EXPECT_LT(Difference(transfer_->Decode(latents, weights, points, offsets), plain), 1e-4);
}

// Of the decoder by latents and by weights, along the gradients: other slopes may be as small as the kinks
// between two steps.
TEST_F(NeuralBranchesTest, GradientsEqualFiniteDifferences) {
  const std::vector<int64_t> offsets = {0, 40};
  const auto latents = torch::randn({1, kHumanJoints, TransferBranchImpl::kLatent}).requires_grad_();
  const auto weights = torch::softmax(torch::randn({40, kHumanJoints}), 1).requires_grad_();
  const auto points = torch::randn({40, 3}), upstream = torch::randn({40, 3});
  const auto value = [&](const torch::Tensor& t, const torch::Tensor& w) {
    return (transfer_->Decode(t, w, points, offsets) * upstream).sum();
  };
  value(latents, weights).backward();
  const torch::NoGradGuard no_grad;
  constexpr double kStep = 1e-3;
  for (const bool of_latents : {true, false}) {
    const auto& gradient = of_latents ? latents.grad() : weights.grad();
    const double slope = gradient.norm().item<double>();
    const auto step = kStep * gradient / slope, none = torch::zeros({1});
    const auto t = of_latents ? step : none, w = of_latents ? none : step;
    const double change = (value(latents + t, weights + w) - value(latents - t, weights - w)).item<double>();
    EXPECT_NEAR(change / (2 * kStep), slope, 0.02 * slope);
    EXPECT_GT(slope, 1);
  }
}

}  // namespace
}  // namespace stance
