#include "core/training/rigged_body.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/mesh/measure.h"
#include "core/skeleton/skeleton.h"
#include "core/training/rigged_bones.h"
#include "core/training/skinning.h"

namespace stance {
namespace {

// Metres: a child's to a tall hat's.
constexpr double kLeastStature = 0.8, kMostStature = 2.6;

// How far a limb's mean radius may be from the neutral's, in statures: clothes are no flesh.
constexpr double kLeastRadiusRatio = 0.6, kMostRadiusRatio = 1.6;

constexpr std::array kAlignedJoints = {kLeftHip,       kRightHip,  kLeftKnee,   kRightKnee, kLeftShoulder,
                                       kRightShoulder, kLeftElbow, kRightElbow, kLeftWrist, kRightWrist};

bool IsAligned(int joint) {
  return std::find(kAlignedJoints.begin(), kAlignedJoints.end(), joint) != kAlignedJoints.end();
}

// The joint at the end of a joint's bone; -1: it is a leaf.
int BoneEnd(int joint) {
  if (joint == kPelvis) return kSpine1;
  if (joint == kSpine3) return kNeck;
  const std::vector<int>& children = HumanSkeleton().children(joint);
  return children.empty() ? -1 : children[0];
}

Eigen::Vector3f Bone(const Points& joints, int joint) {
  return (joints.row(BoneEnd(joint)) - joints.row(joint)).transpose();
}

Eigen::Vector3f Level(const Eigen::Vector3f& v) { return {v.x(), 0, v.z()}; }

// The axis nearest to `direction`, as a unit vector.
Eigen::Vector3f NearestAxis(const Eigen::Vector3f& direction) {
  Eigen::Index axis;
  direction.cwiseAbs().maxCoeff(&axis);
  return Eigen::Vector3f::Unit(axis) * (direction[axis] < 0 ? -1.0f : 1.0f);
}

// The rotation that brings the character to +y up, facing +z, by what its joints say of up and left.
absl::StatusOr<Rotation> ToCanonicalAxes(const Points& joints) {
  const Eigen::Vector3f left =
      NearestAxis((joints.row(kLeftShoulder) - joints.row(kRightShoulder)).transpose());
  const Eigen::Vector3f up = NearestAxis((joints.row(kNeck) - joints.row(kPelvis)).transpose());
  if (left.cwiseAbs() == up.cwiseAbs()) {
    return absl::InvalidArgumentError("the shoulders lie above each other");
  }
  Rotation rotation;
  rotation << left.transpose(), up.transpose(), left.cross(up).transpose();
  return rotation;
}

Eigen::RowVector3f MidHips(const Points& joints) {
  return 0.5f * (joints.row(kLeftHip) + joints.row(kRightHip));
}

// How far along the way from `from` to `to` the point lies: 0 to 1 between them.
float Along(const Eigen::RowVector3f& from, const Eigen::RowVector3f& to, const Eigen::RowVector3f& point) {
  return (point - from).dot(to - from) / (to - from).squaredNorm();
}

// Moves the joints that rigs put at different places of the body to where MPFB has them, +y up: the pelvis on
// the way from the hips to the first spine joint, the collars on that from shoulder to neck, and the feet at
// a part of the ankles' height above the ground.
void PlaceLikeNeutral(const Points& neutral, float ground, Points& joints) {
  const float up = Along(MidHips(neutral), neutral.row(kSpine1), neutral.row(kPelvis));
  joints.row(kPelvis) = (1 - up) * MidHips(joints) + up * joints.row(kSpine1);
  for (const int side : {0, 1}) {
    const int shoulder = kLeftShoulder + side, collar = kLeftCollar + side;
    const float in = Along(neutral.row(shoulder), neutral.row(kNeck), neutral.row(collar));
    joints.row(collar) = (1 - in) * joints.row(shoulder) + in * joints.row(kNeck);
    const int ankle = kLeftAnkle + side, foot = kLeftFoot + side;
    joints(foot, 1) = ground + neutral(foot, 1) / neutral(ankle, 1) * (joints(ankle, 1) - ground);
  }
}

// The row as multiples of 1 / kWeightSteps that sum to 1: the largest takes what rounding leaves.
void Quantize(Eigen::Ref<Eigen::RowVectorXf> row) {
  Eigen::RowVectorXf steps = (row * kWeightSteps).array().round();
  Eigen::Index largest;
  row.maxCoeff(&largest);
  steps[largest] += kWeightSteps - steps.sum();
  row = steps / kWeightSteps;
}

// (V, 24): each bone's weights at its joint; what is bound to nothing hangs on the pelvis.
RowMatrix JointWeights(const RiggedMesh& mesh, const BoneMap& map) {
  RowMatrix weights = RowMatrix::Zero(mesh.weights.rows(), kHumanJoints);
  for (size_t b = 0; b < mesh.bones.size(); ++b) {
    weights.col(map.joint_of_bone[b]) += mesh.weights.col(static_cast<Eigen::Index>(b));
  }
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    if (weights.row(v).sum() == 0) weights(v, kPelvis) = 1;
    Quantize(weights.row(v));
  }
  return weights;
}

// (24) mean distance of a joint's vertices from its bone's axis, or from the joint itself where that is a
// leaf, weighted by skinning weight and area. 0 for a joint without vertices.
std::vector<double> MeanRadii(const RestBody& rest, const RowMatrix& weights, const Faces& faces) {
  const Eigen::VectorXd areas = VertexAreas(rest.positions, faces);
  std::vector<double> radii(kHumanJoints, 0.0);
  for (int j = 0; j < kHumanJoints; ++j) {
    Eigen::Vector3f axis = Eigen::Vector3f::Zero();
    if (BoneEnd(j) >= 0) axis = Bone(rest.joints, j).normalized();
    double sum = 0, total = 0;
    for (Eigen::Index v = 0; v < weights.rows(); ++v) {
      if (weights(v, j) == 0) continue;
      const Eigen::Vector3f offset = (rest.positions.row(v) - rest.joints.row(j)).transpose();
      const double weight = weights(v, j) * areas[v];
      sum += weight * (offset - offset.dot(axis) * axis).norm();
      total += weight;
    }
    if (total > 0) radii[j] = sum / total;
  }
  return radii;
}

}  // namespace

absl::Status CheckRiggedBody(const RiggedBody& body) {
  const Eigen::Index vertices = body.rest.positions.rows();
  const auto bad = [&body](std::string_view what) {
    return absl::InvalidArgumentError(fmt::format("rigged body '{}': {}", body.name, what));
  };
  if (vertices == 0 || vertices > kMaxRiggedVertices) return bad(fmt::format("{} vertices", vertices));
  if (body.faces.rows() == 0) return bad("no faces");
  if (body.faces.minCoeff() < 0 || body.faces.maxCoeff() >= vertices) return bad("face index out of range");
  if (body.rest.joints.rows() != kHumanJoints || !body.rest.joints.allFinite()) return bad("joints");
  if (!body.rest.positions.allFinite() || body.rest.positions.cwiseAbs().maxCoeff() > kMorphUnit * 32767) {
    return bad("a coordinate is not finite or beyond 3.2 m");
  }
  if (!(body.rest.stature >= kLeastStature && body.rest.stature <= kMostStature)) {
    return bad(fmt::format("{} m tall", body.rest.stature));
  }
  if (body.weights.rows() != vertices || body.weights.cols() != kHumanJoints) return bad("weights: shape");
  if (!body.weights.allFinite() || body.weights.minCoeff() < 0 ||
      (body.weights.rowwise().sum().array() - 1).abs().maxCoeff() > 1e-3f) {
    return bad("weights: a row does not sum to 1");
  }
  return absl::OkStatus();
}

std::vector<Rotation> RestRotations(const Points& joints, const Points& neutral) {
  std::vector<Rotation> global(kHumanJoints, Rotation::Identity());
  for (int j = 1; j < kHumanJoints; ++j) {
    global[j] = global[HumanSkeleton().parents()[j]];
    if (IsAligned(j)) {
      global[j] = SmallestRotation(global[j] * Bone(joints, j), Bone(neutral, j)) * global[j];
    } else if (j == kLeftAnkle || j == kRightAnkle) {
      global[j] = SmallestRotation(Level(Bone(joints, j)), Level(Bone(neutral, j)));
    }
  }
  return global;
}

absl::StatusOr<RiggedBody> MakeRiggedBody(const RiggedMesh& mesh, const RestBody& neutral) {
  STANCE_ASSIGN_OR_RETURN(const BoneMap map, MapBones(mesh.bones));
  Points joints(kHumanJoints, 3);
  for (int j = 0; j < kHumanJoints; ++j) joints.row(j) = mesh.bones[map.bone_of_joint[j]].head.transpose();
  STANCE_ASSIGN_OR_RETURN(const Rotation turn, ToCanonicalAxes(joints));
  joints = (joints * turn.transpose()).eval();
  if (joints(kLeftFoot, 2) < joints(kLeftAnkle, 2)) {
    return absl::InvalidArgumentError("the toes point backwards: left and right are exchanged");
  }
  const Points upright = mesh.positions * turn.transpose();
  PlaceLikeNeutral(neutral.joints, upright.col(1).minCoeff(), joints);

  RiggedBody body;
  body.faces = mesh.faces;
  body.weights = JointWeights(mesh, map);
  const std::vector<AffineTransform> transforms =
      PoseTransforms(HumanSkeleton(), joints, RestRotations(joints, neutral.joints));
  body.rest.positions = SkinPoints(upright, body.weights, transforms);
  body.rest.joints = TransformJoints(joints, transforms);

  Eigen::RowVector3f shift = neutral.joints.row(kPelvis) - body.rest.joints.row(kPelvis);
  shift.y() = -body.rest.positions.col(1).minCoeff();
  body.rest.joints.rowwise() += shift;
  body.rest.positions =
      ((body.rest.positions.rowwise() + shift) / kMorphUnit).array().round().matrix() * kMorphUnit;
  body.rest.stature = body.rest.positions.col(1).maxCoeff();
  STANCE_RETURN_IF_ERROR(CheckRiggedBody(body));
  return body;
}

NeutralPlaces::NeutralPlaces(const BodyModel& model) : neutral_(model.Shape({}, 0)) {
  centre_ = neutral_.positions.row(0) - static_cast<float>(neutral_.stature) * model.canonical(0).row(0);
  radii_ = MeanRadii(neutral_, model.weights(0), model.faces(0));
}

Points NeutralPlaces::Of(const RiggedBody& body) const {
  const std::vector<double> radii = MeanRadii(body.rest, body.weights, body.faces);
  const double size = neutral_.stature / body.rest.stature;
  std::vector<AffineTransform> maps(kHumanJoints);
  for (int j = 0; j < kHumanJoints; ++j) {
    const double ratio = radii[j] > 0 ? radii_[j] / radii[j] / size : 1;
    const auto across = static_cast<float>(size * std::clamp(ratio, kLeastRadiusRatio, kMostRadiusRatio));
    maps[j].linear = across * Eigen::Matrix3f::Identity();
    if (BoneEnd(j) >= 0) {
      const Eigen::Vector3f from = Bone(body.rest.joints, j), to = Bone(neutral_.joints, j);
      const Eigen::Vector3f axis = from.normalized();
      maps[j].linear += (to.norm() / from.norm() - across) * axis * axis.transpose();
      maps[j].linear = SmallestRotation(from, to) * maps[j].linear;
    }
    maps[j].translation =
        (neutral_.joints.row(j) - body.rest.joints.row(j) * maps[j].linear.transpose()).transpose();
  }
  const Points places = SkinPoints(body.rest.positions, body.weights, maps);
  return (places.rowwise() - centre_) / static_cast<float>(neutral_.stature);
}

}  // namespace stance
