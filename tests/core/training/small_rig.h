// A rigged character made by the test: a box around each of 24 bones, and some that are no joint's.
#pragma once

#include <string>

#include "core/training/rigged_body.h"
#include "core/training/rigged_mesh.h"

namespace stance::testing {

// The vertices of a bone's box: rows 8 b .. 8 b + 7 belong to bone b.
inline constexpr int kBoxVertices = 8;

// In the A pose of SmallBodyJoints(), +y up and facing +z, with Unreal's bone names (rows 0 to 23, in the
// order of HumanJoint) and behind them "root" above the pelvis, "jaw" below the head, "index_01_l" and
// "thumb_01_l" below the left hand, and "thumb_02_l" below that.
RiggedMesh SmallRig();

// The rig turned: x -> turn x.
RiggedMesh Turned(RiggedMesh mesh, const Rotation& turn);

// Its first 24 bones and their boxes as a GLB file's bytes.
std::string SmallRigGlb();

}  // namespace stance::testing
