// How far a result is from the truth. Nothing here aligns, and only centred_pmd centres; normalise statures
// before the call.
#pragma once

#include <vector>

#include "core/base/types.h"

namespace stance {

// Multiply both meshes by 1.7 / stature before the distance metrics, so that tables compare.
inline constexpr double kReferenceStature = 1.7;  // metres

struct MeshErrors {
  double pmd = 0;               // m^2: mean over vertices of |v - v^|^2 (paper A, section 4.1, as printed)
  double mean_mm = 0;           // mean over vertices of |v - v^|, millimetres
  double max_dist = 0;          // metres: max over vertices of |v - v^|
  double elr = 0;               // paper A: 1/V sum_i sum_{j in N(i)} |1 - |vi-vj|^2 / |v^i-v^j|^2|
  double el = 0;                // m^2: see EdgeLengthError (paper B, equation 20)
  double edge_ratio_error = 0;  // see EdgeRatioError
  double chamfer = 0;           // metres, symmetric: see ChamferDistance
  // m^2: pmd after both meshes have been moved to the same centroid, as some published code does: blind to
  // where the target stands.
  double centred_pmd = 0;
};

// All of them for a predicted mesh (V, 3) against its ground truth with the same faces. N(i) are the vertices
// that share an edge with i, so each undirected edge counts once from each end in ELR.
// REQUIRES: V > 0, equal row counts, valid face indices. Edges of zero true length are skipped by the two
// ratios (ELR and EdgeRatioError).
MeshErrors CompareMeshes(const Points& predicted, const Points& truth, const Faces& faces);

// Paper B's EL as printed (equation 20): the mean over undirected edges of (l - l^)^2, m^2. 0 without edges.
double EdgeLengthError(const Points& predicted, const Points& truth, const Faces& faces);

// The edge ratio error, a dimensionless term that published code reports as EL: the mean over faces of the
// mean over the face's three edges of |l / l^ - 1|. 0 without faces.
double EdgeRatioError(const Points& predicted, const Points& truth, const Faces& faces);

// |v - v^| of each vertex, millimetres.
Eigen::VectorXd VertexErrorsMm(const Points& predicted, const Points& truth);

// Half the sum of both directed mean nearest-neighbour distances between the point sets, metres. Exact.
// REQUIRES: neither set is empty.
double ChamferDistance(const Points& a, const Points& b);

// Paper A's table 1: over poses p of one identity with joints[p] (J, 3), the bone lengths' mean, and the
// largest and the mean over bones of the standard deviation (population) over poses, metres. All 0 for none.
struct BoneLengthDeviation {
  double mean_length = 0;
  double max_deviation = 0;
  double mean_deviation = 0;
};
BoneLengthDeviation CompareBoneLengths(const std::vector<Points>& joints, const std::vector<int>& parents);

}  // namespace stance
