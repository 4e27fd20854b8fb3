#include "core/training/transfer_error.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/skeleton/kinematics.h"
#include "core/transfer/linear_blend_skinning.h"

namespace stance {
namespace {

struct Body {
  Points points;
  RowMatrix weights;
  Points joints;
  std::vector<Rotation> rotations;
};

Body RandomBody(int64_t points) {
  Body body{Points::Random(points, 3),
            RowMatrix::Random(points, kHumanJoints).cwiseAbs(),
            Points::Random(kHumanJoints, 3),
            {}};
  body.weights.array().colwise() /= body.weights.rowwise().sum().array().eval();
  for (int j = 0; j < kHumanJoints; ++j) {
    body.rotations.emplace_back(Eigen::Quaternionf::UnitRandom().toRotationMatrix());
  }
  return body;
}

torch::Tensor Tensor(const float* data, std::vector<int64_t> shape) {
  return torch::from_blob(const_cast<float*>(data), shape).clone();
}

class TransferErrorTest : public ::testing::Test {
 protected:
  TransferErrorTest() {
    std::srand(5);
    std::vector<torch::Tensor> points, weights, joints, rotations;
    for (const int64_t size : {7, 20, 11}) {
      bodies_.push_back(RandomBody(size));
      const Body& body = bodies_.back();
      points.push_back(Tensor(body.points.data(), {size, 3}));
      weights.push_back(Tensor(body.weights.data(), {size, kHumanJoints}));
      joints.push_back(Tensor(body.joints.data(), {kHumanJoints, 3}));
      std::vector<torch::Tensor> columns_first;
      for (const Rotation& rotation : body.rotations) {
        columns_first.push_back(Tensor(rotation.data(), {3, 3}).t());
      }
      rotations.push_back(torch::stack(columns_first));
      offsets_.push_back(offsets_.back() + size);
    }
    points_ = torch::cat(points);
    rigs_ = {torch::cat(weights), torch::stack(joints), torch::stack(rotations)};
  }

  std::vector<Body> bodies_;
  std::vector<int64_t> offsets_{0};
  torch::Tensor points_;
  RigBatch rigs_;
};

TEST_F(TransferErrorTest, DeformsAsThePipelineDoes) {
  const auto deformed = DeformToNext(points_, rigs_, offsets_);
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const Body &body = bodies_[b], &next = bodies_[(b + 1) % bodies_.size()];
    std::vector<Rotation> turns(kHumanJoints);
    for (int j = 0; j < kHumanJoints; ++j) turns[j] = next.rotations[j] * body.rotations[j].transpose();
    const Points expected = LinearBlendSkinning().Deform(body.points, body.weights,
                                                         PoseTransforms(HumanSkeleton(), body.joints, turns));
    for (int64_t i = 0; i < expected.rows(); ++i) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(deformed[offsets_[b] + i][c].item<float>(), expected(i, c), 2e-5);
      }
    }
  }
}

TEST_F(TransferErrorTest, TheTruthHasNone) {
  EXPECT_LT(TransferErrors(points_, rigs_, rigs_, offsets_).max().item<float>(), 2e-4);
}

TEST_F(TransferErrorTest, ACharacterThatTakesItsOwnPoseStaysWhereItIs) {
  const std::vector<int64_t> one{0, offsets_[1]};
  const RigBatch rig{rigs_.weights.narrow(0, 0, offsets_[1]), rigs_.joints.narrow(0, 0, 1),
                     rigs_.rotations.narrow(0, 0, 1)};
  const auto points = points_.narrow(0, 0, offsets_[1]);
  EXPECT_LT((DeformToNext(points, rig, one) - points).abs().max().item<float>(), 1e-5);
}

TEST_F(TransferErrorTest, TeachesWeightsJointsAndRotations) {
  RigBatch predicted{rigs_.weights.flip({0}).clone(), rigs_.joints + 0.1, rigs_.rotations.flip({1}).clone()};
  for (torch::Tensor* tensor : {&predicted.weights, &predicted.joints, &predicted.rotations}) {
    *tensor = tensor->detach().requires_grad_();
  }
  TransferErrors(points_, predicted, rigs_, offsets_).mean().backward();
  for (const torch::Tensor& tensor : {predicted.weights, predicted.joints, predicted.rotations}) {
    EXPECT_TRUE(tensor.grad().isfinite().all().item<bool>());
    EXPECT_GT(tensor.grad().abs().max().item<float>(), 0);
  }
}

}  // namespace
}  // namespace stance
