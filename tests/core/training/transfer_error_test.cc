#include "core/training/transfer_error.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/skeleton/kinematics.h"
#include "core/transfer/learned_rotation_solver.h"
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

// A joint's bones as they are from those at rest by its rotation, but for `noise`.
torch::Tensor PosedJoints(const torch::Tensor& rotations, const torch::Tensor& bones, double noise) {
  std::vector<torch::Tensor> joints = {torch::zeros({rotations.size(0), 3})};
  for (int j = 1; j < kHumanJoints; ++j) {
    const int parent = HumanSkeleton().parents()[j];
    const auto bone =
        torch::matmul(rotations.select(1, parent), bones.select(1, j).unsqueeze(-1)).squeeze(-1);
    joints.push_back(joints[parent] + bone);
  }
  const auto all = torch::stack(joints, 1);
  return all + noise * torch::randn_like(all);
}

TEST_F(TransferErrorTest, CorrectsNothingWhereBonesAndRotationsAgree) {
  torch::manual_seed(3);
  const auto bones = torch::randn({3, kHumanJoints, 3});
  const auto joints = PosedJoints(rigs_.rotations, bones, 0);
  EXPECT_LT(
      (CorrectedByBones(rigs_.rotations, joints, bones, 0.75) - rigs_.rotations).abs().max().item<float>(),
      1e-3);
}

TEST_F(TransferErrorTest, CorrectsAsTheSolverDoes) {
  torch::manual_seed(3);
  const auto bones = torch::randn({3, kHumanJoints, 3});
  const auto joints = PosedJoints(rigs_.rotations, bones, 0.05);
  const auto corrected = CorrectedByBones(rigs_.rotations, joints, bones, 0.75);
  for (int64_t b = 0; b < 3; ++b) {
    Rig rest, posed;  // the solver's rotations go from the first to the second
    rest.rotations.assign(kHumanJoints, Rotation::Identity());
    posed.rotations = bodies_[b].rotations;
    posed.joints.resize(kHumanJoints, 3);
    posed.bones.resize(kHumanJoints, 3);
    for (int j = 0; j < kHumanJoints; ++j) {
      for (int c = 0; c < 3; ++c) {
        posed.joints(j, c) = joints[b][j][c].item<float>();
        posed.bones(j, c) = bones[b][j][c].item<float>();
      }
    }
    rest.bones = posed.bones;
    rest.joints = Points::Zero(kHumanJoints, 3);
    for (int j = 1; j < kHumanJoints; ++j) {
      rest.joints.row(j) = rest.joints.row(HumanSkeleton().parents()[j]) + rest.bones.row(j);
    }
    const TriangleMesh none;
    const std::vector<Rotation> expected =
        LearnedRotationSolver(0.75f, std::nullopt).Solve(HumanSkeleton(), none, rest, none, posed);
    for (int j = 0; j < kHumanJoints; ++j) {
      if (HumanSkeleton().children(j).size() != 1) continue;
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(corrected[b][j][r][c].item<float>(), expected[j](r, c), 0.01) << j;
        }
      }
    }
  }
}

TEST_F(TransferErrorTest, TeachesBonesAlsoWhereTheyAreOpposite) {
  auto bones = torch::randn({3, kHumanJoints, 3});
  const auto joints = (-PosedJoints(rigs_.rotations, bones, 0)).requires_grad_();
  bones.requires_grad_();
  const auto corrected = CorrectedByBones(rigs_.rotations, joints, bones, 0.75);
  (corrected - rigs_.rotations).square().sum().backward();
  for (const torch::Tensor& tensor : {joints, bones})
    EXPECT_TRUE(tensor.grad().isfinite().all().item<bool>());
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
