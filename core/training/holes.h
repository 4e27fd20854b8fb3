// Holes in a mesh, as scans have them.
#pragma once

#include "core/base/random.h"
#include "core/base/types.h"

namespace stance {

// The faces without those whose centroid lies in one of `balls` balls about random corners of faces, 4 to
// 15 cm in radius. A ball that would leave less than 70 % of the whole area cuts nothing. Vertices are not
// touched: some may be left without a face. Positions in metres.
Faces CutHoles(Random& random, int balls, const Points& positions, const Faces& faces);

// The faces without those in balls as large that together hold `share` of the whole area, to a face: the last
// ball is as small as that needs. Each lies about a corner of a face drawn by area, so that finely meshed
// parts (faces, hands) lose no more than others. REQUIRES: 0 <= share < 1.
Faces CutShare(Random& random, double share, const Points& positions, const Faces& faces);

}  // namespace stance
