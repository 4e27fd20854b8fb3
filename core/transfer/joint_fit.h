// Joints that agree with the bones and the rotations found beside them.
#pragma once

#include <vector>

#include "core/skeleton/kinematics.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// A skeleton as a network finds it: every part by itself, with an error of its own.
struct FoundSkeleton {
  Points joints;                    // (J, 3)
  Points bones;                     // (J, 3) from the parent to the joint in the rest pose, the joints' unit
  std::vector<Rotation> rotations;  // (J) global, from the rest pose
  Eigen::VectorXf confidence;       // (J) in [0, 1]
};

// The places x (J, 3) that minimise
//   sum_j |x_j - joints_j|^2 + stiffness sum_j c_j c_p |x_j - x_p - rotations_p bones_j|^2,  p the parent of
//   j:
// a joint's place is known from the joint itself and from where its neighbours' bones end, and less from
// those of joints that are not sure of themselves. One J x J Cholesky. REQUIRES: `found` has J of each;
// stiffness >= 0.
Points FitJoints(const Skeleton& skeleton, const FoundSkeleton& found, float stiffness);

}  // namespace stance
