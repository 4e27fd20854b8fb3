#include "core/transfer/placement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace stance {
namespace {

constexpr float kUndecided = 0.05f;

// 0 up to 60 degrees of elevation, 1 from 80 on, with a continuous slope.
float Steepness(float elevation_sine) {
  constexpr float kFrom = 0.8660254f, kTo = 0.9848078f;
  const float x = std::clamp((std::abs(elevation_sine) - kFrom) / (kTo - kFrom), 0.0f, 1.0f);
  return x * x * (3 - 2 * x);
}

Eigen::Vector3f UnitOrZero(const Eigen::Vector3f& v) {
  const float length = v.norm();
  return length > 1e-9f ? Eigen::Vector3f(v / length) : Eigen::Vector3f::Zero();
}

}  // namespace

PelvisAxes AxesOf(const Rig& rig) {
  if (!rig.rotations.empty()) {
    const Rotation& pelvis = rig.rotations[kPelvis];
    return {pelvis.col(2), pelvis.col(0), PelvisAxes::Lead::kForward};
  }
  const auto joint = [&rig](int j) -> Eigen::Vector3f { return rig.joints.row(j).transpose(); };
  PelvisAxes axes;
  axes.lead = PelvisAxes::Lead::kLeft;
  axes.left = UnitOrZero(joint(kLeftHip) - joint(kRightHip));
  axes.forward = UnitOrZero(axes.left.cross(UnitOrZero(joint(kSpine1) - joint(kPelvis))));
  return axes;
}

Eigen::Vector3f Heading(const PelvisAxes& axes) {
  const Eigen::Vector3f up = Eigen::Vector3f::UnitY();
  const Eigen::Vector3f by_forward = UnitOrZero(axes.forward - axes.forward.y() * up);
  const Eigen::Vector3f by_left = UnitOrZero(axes.left.cross(up));
  if (axes.lead == PelvisAxes::Lead::kForward) {
    const float steep = Steepness(axes.forward.y());
    return (1 - steep) * by_forward + steep * by_left;
  }
  const float steep = Steepness(axes.left.y());
  return (1 - steep) * by_left + steep * by_forward;
}

Rotation FacingTurn(const PelvisAxes& source, const Rotation& pelvis) {
  const Eigen::Vector3f wanted = Heading(source);
  const Eigen::Vector3f found = Heading({pelvis * source.forward, pelvis * source.left, source.lead});
  if (!(wanted.norm() >= kUndecided) || !(found.norm() >= kUndecided)) return Rotation::Identity();
  const float angle = std::atan2(wanted.x(), wanted.z()) - std::atan2(found.x(), found.z());
  return Eigen::AngleAxisf(angle, Eigen::Vector3f::UnitY()).toRotationMatrix();
}

float LowestHeight(const Points& positions, const Faces& faces, const Eigen::Vector3f& up) {
  float lowest = std::numeric_limits<float>::infinity();
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      lowest = std::min(lowest, positions.row(faces(f, corner)).dot(up));
    }
  }
  return lowest;
}

}  // namespace stance
