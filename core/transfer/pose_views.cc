#include "core/transfer/pose_views.h"

#include <Eigen/Geometry>
#include <numbers>
#include <utility>

#include "core/base/check.h"
#include "core/skeleton/mirror.h"

namespace stance {
namespace {

Rotation Turn(double radians, const Eigen::Vector3f& axis) {
  return Eigen::AngleAxisf(static_cast<float>(radians), axis).toRotationMatrix();
}

}  // namespace

std::vector<PoseView> EvenViews(int count) {
  STANCE_CHECK(count >= 1);
  const int mirrored = count % 2 == 0 ? count / 2 : 0, plain = count - mirrored;
  std::vector<PoseView> views;
  for (int i = 0; i < count; ++i) {
    const double yaw = 2 * std::numbers::pi * (i % plain) / plain;
    views.push_back({Turn(yaw, Eigen::Vector3f::UnitY()), i >= plain});
  }
  return views;
}

std::vector<PoseView> OtherSides() {
  constexpr double kQuarter = std::numbers::pi / 2;
  const Eigen::Vector3f x = Eigen::Vector3f::UnitX(), z = Eigen::Vector3f::UnitZ();
  return {{.turn = Turn(kQuarter, x)},
          {.turn = Turn(-kQuarter, x)},
          {.turn = Turn(kQuarter, z)},
          {.turn = Turn(-kQuarter, z)},
          {.turn = Turn(2 * kQuarter, x)}};
}

PyramidInput ViewedInput(const PyramidInput& input, const PoseView& view) {
  PyramidInput viewed = input;
  for (Points* points : {&viewed.points, &viewed.normals}) {
    if (view.mirrored) points->col(0) *= -1;
    *points = (*points * view.turn.transpose()).eval();
  }
  return viewed;
}

PoseEstimate EstimateBehindView(PoseEstimate estimate, const PoseView& view) {
  const Rotation back = view.turn.transpose();
  estimate.joints = (estimate.joints * back.transpose()).eval();
  for (Rotation& rotation : estimate.rotations) rotation = back * rotation;
  if (!view.mirrored) return estimate;

  estimate.canonical.col(0) *= -1;
  estimate.joints = MirroredJoints(estimate.joints);
  estimate.bones = MirroredJoints(estimate.bones);
  estimate.rotations = MirroredRotations(estimate.rotations);
  estimate.weights = MirroredWeights(estimate.weights);
  const Eigen::VectorXf confidence = estimate.confidence;
  for (int j = 0; j < kHumanJoints; ++j) estimate.confidence[j] = confidence[MirrorJoint(j)];
  return estimate;
}

PoseEstimate MeanEstimate(std::span<const PoseEstimate> estimates) {
  STANCE_CHECK(!estimates.empty());
  PoseEstimate mean = estimates[0];
  for (const PoseEstimate& estimate : estimates.subspan(1)) {
    mean.weights += estimate.weights;
    mean.canonical += estimate.canonical;
    mean.joints += estimate.joints;
    mean.bones += estimate.bones;
    mean.confidence += estimate.confidence;
    for (int j = 0; j < kHumanJoints; ++j) mean.rotations[j] += estimate.rotations[j];
  }
  const float share = 1 / static_cast<float>(estimates.size());
  mean.weights *= share;
  mean.canonical *= share;
  mean.joints *= share;
  mean.bones *= share;
  mean.confidence *= share;
  for (Rotation& rotation : mean.rotations) rotation = NearestRotation(rotation);
  return mean;
}

}  // namespace stance
