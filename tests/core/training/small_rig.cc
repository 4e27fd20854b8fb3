#include "tests/core/training/small_rig.h"

#include "core/base/check.h"
#include "core/skeleton/bone_names.h"
#include "core/transfer/skinned_glb.h"
#include "tests/core/training/small_data.h"
#include "tests/support/meshes.h"

namespace stance::testing {
namespace {

// A box around each point, bound to the bone of that row.
RiggedMesh BoxesAround(const Points& points) {
  const TriangleMesh box = Box(0.05f, 0.06f, 0.07f);
  const Eigen::Index corners = box.positions.rows(), sides = box.faces.rows(), bones = points.rows();
  STANCE_CHECK(corners == kBoxVertices);
  RiggedMesh mesh;
  mesh.positions.resize(bones * corners, 3);
  mesh.faces.resize(bones * sides, 3);
  mesh.weights = RowMatrix::Zero(bones * corners, bones);
  for (Eigen::Index b = 0; b < bones; ++b) {
    mesh.positions.middleRows(b * corners, corners) = box.positions.rowwise() + points.row(b);
    mesh.faces.middleRows(b * sides, sides) = box.faces.array() + static_cast<int32_t>(b * corners);
    mesh.weights.block(b * corners, b, corners, 1).setOnes();
  }
  return mesh;
}

}  // namespace

RiggedMesh SmallRig() {
  const Points joints = SmallBodyJoints();
  const Eigen::Vector3f hand = joints.row(kLeftHand).transpose();
  std::vector<FileBone> bones(kHumanJoints);
  for (int j = 0; j < kHumanJoints; ++j) {
    bones[j] = {HumanBoneNames(BoneNaming::kUnreal)[j], HumanSkeleton().parents()[j],
                joints.row(j).transpose()};
  }
  bones.push_back({"root", -1, Eigen::Vector3f::Zero()});
  bones.push_back({"jaw", kHead, {0, 1.55f, 0.05f}});
  bones.push_back({"index_01_l", kLeftWrist, hand + Eigen::Vector3f(0, 0, 0.03f)});
  bones.push_back({"thumb_01_l", kLeftWrist, hand + Eigen::Vector3f(0, 0, 0.06f)});
  bones.push_back({"thumb_02_l", 27, hand + Eigen::Vector3f(0, 0, 0.09f)});
  Points heads(std::ssize(bones), 3);
  for (Eigen::Index b = 0; b < heads.rows(); ++b) heads.row(b) = bones[b].head.transpose();
  RiggedMesh mesh = BoxesAround(heads);
  mesh.bones = std::move(bones);
  return mesh;
}

RiggedMesh Turned(RiggedMesh mesh, const Rotation& turn) {
  mesh.positions = (mesh.positions * turn.transpose()).eval();
  for (FileBone& bone : mesh.bones) bone.head = (turn * bone.head).eval();
  return mesh;
}

std::string SmallRigGlb() {
  const RiggedMesh rig = BoxesAround(SmallBodyJoints());
  TriangleMesh mesh;
  mesh.positions = rig.positions;
  mesh.faces = rig.faces;
  const auto bytes = SerializeSkinnedGlb(mesh, HumanSkeleton(), {SmallBodyJoints(), rig.weights},
                                         HumanBoneNames(BoneNaming::kUnreal));
  STANCE_CHECK(bytes.ok());
  return *bytes;
}

}  // namespace stance::testing
