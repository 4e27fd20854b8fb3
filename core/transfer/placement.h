// Where a target faces and stands: TransferOptions::facing and ground.
#pragma once

#include <Eigen/Core>

#include "core/mesh/triangle_mesh.h"
#include "core/transfer/parts.h"

namespace stance {

// The horizontal axes of a body, fixed to its pelvis: unit vectors, or zero where they are not known.
struct PelvisAxes {
  Eigen::Vector3f forward = Eigen::Vector3f::Zero();  // +z of the rest pose
  Eigen::Vector3f left = Eigen::Vector3f::Zero();     // +x of the rest pose
  // Which of the two says where the body faces while it is upright.
  enum class Lead { kForward, kLeft } lead = Lead::kForward;
};

// Of a rig of the human skeleton in the frame of its mesh. With learned rotations both are the pelvis's own
// and `forward` leads; otherwise `left` leads, from the right hip to the left one, and `forward` is `left` x
// (pelvis to spine1).
PelvisAxes AxesOf(const Rig& rig);

// The direction on the ground, +y up, in which a body faces: the leading axis's word for it, which is the
// projection of `forward`, or `left` x up. As the leading axis comes within 30 degrees of the vertical the
// other's word takes over smoothly, and alone within 10: so a figure that lies on its back or face faces
// where it would after rising about its hips' axis. Shorter than 1 where they disagree; zero where neither
// says anything. Turns with the body: Heading(T axes) = T Heading(axes) for every turn T about +y.
Eigen::Vector3f Heading(const PelvisAxes& axes);

// The turn about +y that makes a target, the source after `pelvis`, face as its source does. The identity
// where one of the two does not say where it faces (length of Heading below 0.05).
Rotation FacingTurn(const PelvisAxes& source, const Rotation& pelvis);

// The least height, along the unit vector `up`, of a vertex that a face has. REQUIRES: mesh has faces.
float LowestHeight(const Points& positions, const Faces& faces, const Eigen::Vector3f& up);

}  // namespace stance
