// What the character generator makes, the trainer learns from and the evaluator measures against.
#pragma once

#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/skeleton/kinematics.h"

namespace stance {

// One posed character with everything a loss or a metric needs. Metres, y up (before any global rotation).
struct Character {
  TriangleMesh mesh;                // posed
  RowMatrix weights;                // (V, 24), rows sum to 1
  Points joints;                    // (24, 3) posed
  Points rest_joints;               // (24, 3) where they are in the rest (T) pose
  std::vector<Rotation> rotations;  // (24) each joint's global rotation from the rest (T) pose
  Points canonical;                 // (V, 3) the vertex's place on the neutral body at rest, normalised:
                                    // centred on the neutral's bounding box, divided by its stature
  double stature = 0;               // metres, height of this identity at rest
};

// A transfer with its exact answer: the source's identity under the reference's pose.
struct TransferPair {
  Character source;
  Character reference;
  Points truth;  // (V of source, 3); the pelvis joint is where the source's is (paper A translates nothing)
};

}  // namespace stance
