// Makes a rig's raw skinning weights fit to learn from.
#pragma once

#include "core/base/types.h"

namespace stance {

// (V, 24) weights, of sums that may differ from 1 (MPFB's run from 0.2 to 1.5), to weights that are
//   1. normalised: each row sums to 1;
//   2. symmetric: a vertex and the one nearest to its mirror image in x share the mean of their weights,
//      joints exchanged;
//   3. smooth: two steps of averaging with the mean over the one-ring;
//   4. sparse: influences below 0.5 % are dropped.
// A row without any weight takes its neighbours'; it stays zero where they have none either.
RowMatrix CleanWeights(const RowMatrix& raw, const Points& vertices, const Faces& faces);

}  // namespace stance
