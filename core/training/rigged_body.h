// A rigged character brought to the canonical joints and the rest (T) pose, as MPFB's identities are.
#pragma once

#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/base/types.h"
#include "core/skeleton/kinematics.h"
#include "core/training/body_model.h"
#include "core/training/rigged_mesh.h"

namespace stance {

// Weights are kept in 8 bits, as many tools do.
inline constexpr int kWeightSteps = 255;

// Most vertices: faces name them in 16 bits.
inline constexpr int64_t kMaxRiggedVertices = 65536;

// An identity with a mesh of its own.
struct RiggedBody {
  std::string name;       // the folder's and the file's, "rocketbox/Male_Adult_01"
  bool held_out = false;  // for tests only
  RestBody rest;          // positions are multiples of kMorphUnit
  Faces faces;
  RowMatrix weights;  // (V, 24) multiples of 1 / kWeightSteps; rows sum to 1
};

// INVALID_ARGUMENT, naming the first inconsistent field.
absl::Status CheckRiggedBody(const RiggedBody& body);

// The global rotations (24) from the pose of `joints` to the rest pose: down the tree each limb takes the
// smallest rotation, after its parent's, that points it as the neutral's; an ankle turns about the up axis
// only, so that soles stay flat. The trunk and the head, which stand upright in any rig, keep their
// directions: where along it a rig has its joints says nothing about a pose.
std::vector<Rotation> RestRotations(const Points& joints, const Points& neutral);

// The character as MapBones reads its rig, posed at rest by its own weights, its pelvis above the neutral's,
// feet on y = 0. `neutral` is BodyModel::Shape({}, 0). Name and held_out are left to the caller.
// INVALID_ARGUMENT if the rig lacks a joint, stands on no axis, or is no human's size.
absl::StatusOr<RiggedBody> MakeRiggedBody(const RiggedMesh& mesh, const RestBody& neutral);

// Carries rigged identities to their places on the neutral body.
class NeutralPlaces {
 public:
  explicit NeutralPlaces(const BodyModel& model);

  // (V, 3) as Character::canonical: each joint's bone is stretched to the neutral's length along and to its
  // mean radius across, and the weights blend these maps.
  Points Of(const RiggedBody& body) const;

 private:
  RestBody neutral_;
  Eigen::RowVector3f centre_;
  std::vector<double> radii_;  // (24) metres
};

}  // namespace stance
