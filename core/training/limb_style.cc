#include "core/training/limb_style.h"

#include <cmath>

#include "core/skeleton/skeleton.h"

namespace stance {

LimbScales SampleLimbScales(Random& random) {
  const auto scale = [&random](double deviation) {
    return static_cast<float>(std::exp(random.Normal(0, deviation)));
  };
  const auto scales = [&scale](double x, double y, double z) {
    const float a = scale(x), b = scale(y), c = scale(z);
    return Eigen::Vector3f(a, b, c);
  };
  const Eigen::Vector3f trunk = scales(0.15, 0.12, 0.15);
  const Eigen::Vector3f leg = scales(0.18, 0.15, 0.18);
  const Eigen::Vector3f arm = scales(0.15, 0.2, 0.2);  // x is along the arm
  const Eigen::Vector3f head = scale(0.2) * scales(0.07, 0.07, 0.07);
  const Eigen::Vector3f hand = Eigen::Vector3f::Constant(scale(0.2));
  const Eigen::Vector3f foot = scale(0.18) * scales(0.08, 0.0, 0.12);

  LimbScales result(kHumanJoints);
  for (const int j : {kPelvis, kSpine1, kSpine2, kSpine3}) result[j] = trunk;
  for (const int j : {kLeftHip, kRightHip, kLeftKnee, kRightKnee}) result[j] = leg;
  for (const int j : {kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot}) result[j] = foot;
  for (const int j : {kLeftShoulder, kRightShoulder, kLeftElbow, kRightElbow}) result[j] = arm;
  for (const int j : {kLeftWrist, kRightWrist, kLeftHand, kRightHand}) result[j] = hand;
  result[kNeck] = 0.5f * (trunk + head);
  result[kHead] = head;
  result[kLeftCollar] = result[kRightCollar] = 0.5f * (trunk + arm);
  return result;
}

std::vector<AffineTransform> ScaledPoseTransforms(const Points& joints, const std::vector<Rotation>& global,
                                                  const LimbScales& scales) {
  std::vector<AffineTransform> transforms(global.size());
  for (int j = 0; j < kHumanJoints; ++j) {
    const Eigen::Vector3f joint = joints.row(j).transpose();
    const Eigen::Vector3f posed = j == 0 ? joint : transforms[HumanSkeleton().parents()[j]].Apply(joint);
    transforms[j].linear = global[j] * scales[j].asDiagonal();
    transforms[j].translation = posed - transforms[j].linear * joint;
  }
  return transforms;
}

}  // namespace stance
