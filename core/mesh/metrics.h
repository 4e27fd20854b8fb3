// How far a result is from the truth. Nothing here centres or aligns; normalise statures before the call.
#pragma once

#include <vector>

#include "core/base/types.h"

namespace stance {

// Multiply both meshes by 1.7 / stature before the distance metrics, so that tables compare.
inline constexpr double kReferenceStature = 1.7;  // metres

struct MeshErrors {
  double pmd = 0;       // m^2: mean over vertices of |v - v^|^2 (paper A, section 4.1, as printed)
  double mean_mm = 0;   // mean over vertices of |v - v^|, millimetres
  double max_dist = 0;  // metres: max over vertices of |v - v^|
  double elr = 0;       // paper A: 1/V sum_i sum_{j in N(i)} |1 - |vi-vj|^2 / |v^i-v^j|^2|
  double el = 0;        // paper B: see EdgeLengthError
  double chamfer = 0;   // metres, symmetric: see ChamferDistance
};

// All of them for a predicted mesh (V, 3) against its ground truth with the same faces.
// REQUIRES: equal row counts, valid face indices. Edges of zero true length are skipped by ELR and EL.
MeshErrors CompareMeshes(const Points& predicted, const Points& truth, const Faces& faces);

// Paper B's edge-length metric: the mean over faces of the mean over the face's three edges of |l / l^ - 1|.
double EdgeLengthError(const Points& predicted, const Points& truth, const Faces& faces);

// Half the sum of both directed mean nearest-neighbour distances between the point sets, metres.
double ChamferDistance(const Points& a, const Points& b);

// Paper A's table 1: over poses p of one identity with joints[p] (J, 3), the bone lengths' mean, and the
// largest and the mean over bones of the standard deviation (population) over poses, metres.
struct BoneLengthDeviation {
  double mean_length = 0;
  double max_deviation = 0;
  double mean_deviation = 0;
};
BoneLengthDeviation CompareBoneLengths(const std::vector<Points>& joints, const std::vector<int>& parents);

}  // namespace stance
