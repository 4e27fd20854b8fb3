#include "tests/support/puppet.h"

#include <Eigen/Geometry>

#include "core/base/random.h"
#include "core/transfer/linear_blend_skinning.h"
#include "tests/support/meshes.h"

namespace stance::testing {

Puppet MakePuppet() {
  Puppet puppet;
  puppet.rig.joints.resize(kHumanJoints, 3);
  puppet.rig.joints << 0, 0.95f, 0,                                                  // pelvis
      0.09f, 0.90f, 0, -0.09f, 0.90f, 0, 0, 1.05f, -0.02f,                           // hips, spine1
      0.10f, 0.50f, 0, -0.10f, 0.50f, 0, 0, 1.17f, -0.01f,                           // knees, spine2
      0.10f, 0.09f, -0.02f, -0.10f, 0.09f, -0.02f, 0, 1.28f, 0,                      // ankles, spine3
      0.11f, 0.03f, 0.10f, -0.11f, 0.03f, 0.10f, 0, 1.45f, -0.02f,                   // feet, neck
      0.06f, 1.39f, 0, -0.06f, 1.39f, 0, 0, 1.55f, 0.02f,                            // collars, head
      0.18f, 1.40f, -0.01f, -0.18f, 1.40f, -0.01f,                                   // shoulders
      0.44f, 1.40f, -0.02f, -0.44f, 1.40f, -0.02f,                                   // elbows
      0.69f, 1.40f, 0, -0.69f, 1.40f, 0, 0.78f, 1.39f, 0.01f, -0.78f, 1.39f, 0.01f;  // wrists, hands
  const TriangleMesh ball = Icosphere(1, 0.03f);
  const int64_t v = ball.vertex_count(), f = ball.face_count();
  puppet.mesh.positions.resize(v * kHumanJoints, 3);
  puppet.mesh.faces.resize(f * kHumanJoints, 3);
  puppet.rig.weights = RowMatrix::Zero(v * kHumanJoints, kHumanJoints);
  for (int j = 0; j < kHumanJoints; ++j) {
    const auto& children = HumanSkeleton().children(j);
    const Eigen::RowVector3f joint = puppet.rig.joints.row(j);
    const Eigen::RowVector3f bone = children.empty()
                                        ? joint - puppet.rig.joints.row(HumanSkeleton().parents()[j])
                                        : Eigen::RowVector3f(puppet.rig.joints.row(children[0]) - joint);
    puppet.mesh.positions.middleRows(j * v, v) = ball.positions.rowwise() + (joint + 0.5f * bone);
    puppet.mesh.faces.middleRows(j * f, f) = ball.faces.array() + static_cast<int32_t>(j * v);
    puppet.rig.weights.block(j * v, j, v, 1).setOnes();
  }
  return puppet;
}

Puppet Pose(const Puppet& puppet, const std::vector<Rotation>& global) {
  Puppet posed = puppet;
  const auto transforms = PoseTransforms(HumanSkeleton(), puppet.rig.joints, global);
  posed.mesh.positions = LinearBlendSkinning().Deform(puppet.mesh.positions, puppet.rig.weights, transforms);
  for (int j = 0; j < kHumanJoints; ++j) {
    posed.rig.joints.row(j) = transforms[j].Apply(puppet.rig.joints.row(j).transpose()).transpose();
  }
  return posed;
}

std::vector<Rotation> RandomPose(uint64_t seed, double angle) {
  Random random(seed);
  std::vector<Rotation> local;
  for (int j = 0; j < kHumanJoints; ++j) {
    const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
    local.push_back(
        Eigen::AngleAxisd(random.Uniform(-angle, angle), axis.normalized()).toRotationMatrix().cast<float>());
  }
  return GlobalRotations(HumanSkeleton(), local);
}

}  // namespace stance::testing
