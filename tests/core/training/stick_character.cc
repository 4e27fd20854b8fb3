#include "tests/core/training/stick_character.h"

#include "core/transfer/linear_blend_skinning.h"
#include "tests/support/meshes.h"

namespace stance::testing {

Character StickCharacter() {
  Character character;
  character.stature = 1.7;
  character.joints.resize(kHumanJoints, 3);
  character.joints << 0, 0.95f, 0,              // pelvis
      0.1f, 0.87f, 0, -0.1f, 0.87f, 0,          // hips
      0, 1.05f, 0,                              // spine1
      0.1f, 0.48f, 0, -0.1f, 0.48f, 0,          // knees
      0, 1.18f, 0,                              // spine2
      0.1f, 0.08f, 0, -0.1f, 0.08f, 0,          // ankles
      0, 1.3f, 0,                               // spine3
      0.1f, 0.03f, 0.12f, -0.1f, 0.03f, 0.12f,  // feet
      0, 1.48f, 0,                              // neck
      0.07f, 1.42f, 0, -0.07f, 1.42f, 0,        // collars
      0, 1.58f, 0,                              // head
      0.18f, 1.42f, 0, -0.18f, 1.42f, 0,        // shoulders
      0.45f, 1.42f, 0, -0.45f, 1.42f, 0,        // elbows
      0.7f, 1.42f, 0, -0.7f, 1.42f, 0,          // wrists
      0.78f, 1.42f, 0, -0.78f, 1.42f, 0;        // hands
  const TriangleMesh box = Box(0.05f, 0.06f, 0.07f);
  const Eigen::Index corners = box.positions.rows(), sides = box.faces.rows();
  character.mesh.positions.resize(kHumanJoints * corners, 3);
  character.mesh.faces.resize(kHumanJoints * sides, 3);
  character.weights = RowMatrix::Zero(kHumanJoints * corners, kHumanJoints);
  for (int j = 0; j < kHumanJoints; ++j) {
    character.mesh.positions.middleRows(j * corners, corners) =
        box.positions.rowwise() + character.joints.row(j);
    character.mesh.faces.middleRows(j * sides, sides) = box.faces.array() + static_cast<int32_t>(j * corners);
    character.weights.block(j * corners, j, corners, 1).setOnes();
  }
  character.rotations.assign(kHumanJoints, Rotation::Identity());
  return character;
}

Character Posed(const Character& rest, const std::vector<Rotation>& global) {
  Character posed = rest;
  const std::vector<AffineTransform> transforms = PoseTransforms(HumanSkeleton(), rest.joints, global);
  posed.mesh.positions = LinearBlendSkinning().Deform(rest.mesh.positions, rest.weights, transforms);
  for (int j = 0; j < kHumanJoints; ++j) {
    posed.joints.row(j) = transforms[j].Apply(rest.joints.row(j).transpose()).transpose();
    posed.rotations[j] = global[j] * rest.rotations[j];
  }
  return posed;
}

}  // namespace stance::testing
