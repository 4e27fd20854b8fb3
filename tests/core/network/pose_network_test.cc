#include "core/network/pose_network.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/network/pyramid_input.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

PyramidInput InputOf(const TriangleMesh& mesh, int64_t samples) {
  return MakePyramidInput(ResampleSurface(mesh, {samples, 12}), 1);
}

TriangleMesh Lopsided() {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.2f, 24, 6, 20);
  mesh.positions.col(0) += 0.2f * mesh.positions.col(1).cwiseAbs2() + 0.1f * mesh.positions.col(2);
  return mesh;
}

PyramidBatch BatchOf(const std::vector<PyramidInput>& inputs) {
  std::vector<const PyramidInput*> pointers;
  for (const PyramidInput& input : inputs) pointers.push_back(&input);
  return StackPyramids(pointers);
}

// With running statistics of its own, as after some training.
PoseNetwork Network() {
  torch::manual_seed(7);
  PoseNetwork network;
  const PyramidBatch batch = BatchOf({InputOf(Lopsided(), 200), InputOf(testing::Icosphere(4), 160)});
  for (int i = 0; i < 3; ++i) network(batch);
  network->eval();
  return network;
}

float Difference(const torch::Tensor& a, const torch::Tensor& b) { return (a - b).abs().max().item<float>(); }

TEST(PyramidInput, LevelsAreQuartersRoundedUp) {
  EXPECT_EQ(RowsOfLevel(1024, 0), 1024);
  EXPECT_EQ(RowsOfLevel(1024, 1), 256);
  EXPECT_EQ(RowsOfLevel(1025, 2), 65);
  EXPECT_EQ(RowsOfLevel(1, 2), 1);
}

TEST(PyramidInput, ShowsNoMoreThanItsFeatures) {
  const SurfaceSamples samples = ResampleSurface(testing::TwoSpheres(3), {200, 12});
  const PyramidInput all = MakePyramidInput(samples, 1);
  const PyramidInput blind = MakePyramidInput(samples, 1, {.normals = false});
  EXPECT_GT(all.normals.norm(), 1);
  EXPECT_EQ(blind.normals.norm(), 0);
  EXPECT_EQ(blind.near, all.near);

  const PyramidInput euclidean = MakePyramidInput(samples, 1, {.geodesic = false});
  EXPECT_EQ(euclidean.normals, all.normals);
  for (int level = 0; level < kPyramidLevels; ++level) {
    const Points points = samples.points.topRows(RowsOfLevel(200, level));
    ASSERT_EQ(euclidean.near[level].rows(), points.rows());
    for (int64_t i = 0; i < points.rows(); ++i) {
      EXPECT_EQ(euclidean.near[level](i, 0), i);
      const float reach =
          (points.row(euclidean.near[level](i, kPyramidNeighbors - 1)) - points.row(i)).norm();
      const auto nearer =
          ((points.rowwise() - points.row(i)).rowwise().norm().array() < reach - 1e-5f).count();
      EXPECT_LT(nearer, kPyramidNeighbors);
    }
  }
  EXPECT_EQ(euclidean.coarse[0].rows(), 200);
  EXPECT_LT(euclidean.coarse[0].maxCoeff(), RowsOfLevel(200, 1));
}

TEST(PyramidInput, NeighboursAreOfTheirLevel) {
  const PyramidInput input = InputOf(Lopsided(), 200);
  for (int level = 0; level < kPyramidLevels; ++level) {
    EXPECT_EQ(input.near[level].rows(), RowsOfLevel(200, level));
    EXPECT_GE(input.near[level].minCoeff(), 0);
    EXPECT_LT(input.near[level].maxCoeff(), RowsOfLevel(200, level));
    for (int64_t row = 0; row < RowsOfLevel(200, level); ++row) EXPECT_EQ(input.near[level](row, 0), row);
    if (level + 1 == kPyramidLevels) break;
    EXPECT_EQ(input.coarse[level].rows(), RowsOfLevel(200, level));
    EXPECT_EQ(input.coarse[level].cols(), kCoarseNeighbors);
    EXPECT_LT(input.coarse[level].maxCoeff(), RowsOfLevel(200, level + 1));
    for (int64_t row = 0; row < RowsOfLevel(200, level + 1); ++row) {
      EXPECT_EQ(input.coarse[level](row, 0), row);
    }
  }
}

TEST(StackPyramids, StacksEachLevelByItself) {
  const std::vector<PyramidInput> inputs = {InputOf(Lopsided(), 200), InputOf(testing::Icosphere(4), 150)};
  const PyramidBatch batch = BatchOf(inputs), second = BatchOf({inputs[1]});
  EXPECT_EQ(batch.offsets[0], (std::vector<int64_t>{0, 200, 350}));
  EXPECT_EQ(batch.offsets[1], (std::vector<int64_t>{0, 50, 50 + 38}));
  EXPECT_EQ(batch.offsets[2], (std::vector<int64_t>{0, 13, 13 + 10}));
  EXPECT_TRUE(batch.points.slice(0, 200).equal(second.points));
  EXPECT_TRUE((batch.near[1].slice(0, 50) - 50).equal(second.near[1]));
  EXPECT_TRUE((batch.near[2].slice(0, 13) - 13).equal(second.near[2]));
  EXPECT_TRUE((batch.coarse[0].slice(0, 200) - 50).equal(second.coarse[0]));
  EXPECT_TRUE((batch.coarse[1].slice(0, 50) - 13).equal(second.coarse[1]));
  EXPECT_TRUE((batch.rows[0].slice(0, 50) - 200).equal(second.rows[0]));
  EXPECT_TRUE((batch.rows[1].slice(0, 13) - 50).equal(second.rows[1]));
}

TEST(RotationsFromSix, AreRotations) {
  torch::manual_seed(1);
  const auto rotations = RotationsFromSix(torch::randn({50, 6}));
  EXPECT_LT(Difference(torch::matmul(rotations, rotations.transpose(1, 2)), torch::eye(3).expand({50, 3, 3})),
            1e-5f);
  EXPECT_LT(Difference(torch::det(rotations), torch::ones({50})), 1e-5f);
  // Those of a rotation's own first two columns are that rotation.
  const auto six = torch::cat({rotations.select(2, 0), rotations.select(2, 1)}, 1);
  EXPECT_LT(Difference(RotationsFromSix(six), rotations), 1e-5f);
}

TEST(MaxConv, EqualsTheFormulaOverEdges) {
  torch::manual_seed(2);
  MaxConv layer(5, 8);
  const auto x = torch::randn({30, 5});
  const auto table = torch::randint(30, {12, 4}, torch::kInt32);
  const auto self = x.slice(0, 0, 12);
  for (int i = 0; i < 3; ++i) layer(x, self, table);
  layer->norm->weight.data().copy_(torch::randn({8}));  // some scales negative
  layer->eval();
  const auto neighbor = x.index_select(0, table.reshape({-1}).to(torch::kInt64)).reshape({12, 4, 5});
  const auto edges = torch::matmul(neighbor - self.unsqueeze(1), layer->weight_edge.t());
  const auto most = std::get<0>(edges.max(1)) + torch::mm(self, layer->weight_self.t());
  EXPECT_LT(Difference(layer(x, self, table), torch::leaky_relu(layer->norm(most), kLeakySlope)), 1e-4f);
}

TEST(PoseNetwork, ABatchEqualsItsMeshesAlone) {
  torch::NoGradGuard no_grad;
  PoseNetwork network = Network();
  const std::vector<PyramidInput> inputs = {InputOf(Lopsided(), 200), InputOf(testing::Icosphere(4), 160)};
  const PosePrediction both = network(BatchOf(inputs));
  for (int64_t mesh = 0; mesh < 2; ++mesh) {
    const PosePrediction one = network(BatchOf({inputs[mesh]}));
    const int64_t first = mesh * 200, last = first + (mesh == 0 ? 200 : 160);
    EXPECT_LT(Difference(both.logits.slice(0, first, last), one.logits), 1e-3f);
    EXPECT_LT(Difference(both.canonical.slice(0, first, last), one.canonical), 1e-4f);
    EXPECT_LT(Difference(both.joints[mesh], one.joints[0]), 1e-4f);
    EXPECT_LT(Difference(both.rotations[mesh], one.rotations[0]), 1e-3f);
    EXPECT_LT(Difference(both.confidence[mesh], one.confidence[0]), 1e-3f);
  }
}

TEST(PoseNetwork, ScaleAndPlaceOfTheMeshDoNotMatter) {
  torch::NoGradGuard no_grad;
  PoseNetwork network = Network();
  PyramidInput input = InputOf(Lopsided(), 200);
  const PosePrediction before = network(BatchOf({input}));
  input.points = (100 * input.points).rowwise() + Eigen::RowVector3f(3, -500, 20);
  const PosePrediction after = network(BatchOf({input}));
  EXPECT_LT(Difference(before.joints, after.joints), 1e-3f);
  EXPECT_LT(Difference(before.rotations, after.rotations), 1e-2f);
}

TEST(PoseNetwork, EveryParameterGetsAGradient) {
  PoseNetwork network = Network();
  network->train();
  const PosePrediction out =
      network(BatchOf({InputOf(Lopsided(), 200), InputOf(testing::Icosphere(4), 160)}));
  (out.logits.square().mean() + out.canonical.square().mean() + out.joints.square().mean() +
   (out.rotations * torch::randn_like(out.rotations)).mean() +
   (out.bones * torch::randn_like(out.bones)).mean() + out.confidence.square().mean())
      .backward();
  for (const auto& parameter : network->named_parameters()) {
    ASSERT_TRUE(parameter.value().grad().defined()) << parameter.key();
    EXPECT_TRUE(parameter.value().grad().isfinite().all().item<bool>()) << parameter.key();
    EXPECT_GT(parameter.value().grad().abs().max().item<float>(), 0) << parameter.key();
  }
}

TEST(PoseNetwork, GivenWeightsReplaceThePredictedOnesInThePooling) {
  torch::NoGradGuard no_grad;
  PoseNetwork network = Network();
  const PyramidBatch batch = BatchOf({InputOf(Lopsided(), 200)});
  const PosePrediction own = network(batch);
  const PosePrediction same = network(batch, torch::softmax(own.logits, 1));
  EXPECT_LT(Difference(own.joints, same.joints), 1e-5f);
  const PosePrediction uniform = network(batch, torch::full({200, kHumanJoints}, 1.0f / kHumanJoints));
  EXPECT_TRUE(own.logits.equal(uniform.logits));
  EXPECT_GT(Difference(own.joints, uniform.joints), 1e-4f);
}

}  // namespace
}  // namespace stance
