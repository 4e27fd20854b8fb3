// Rigs whose weights are known at a mesh's surface samples.
#pragma once

#include "core/transfer/parts.h"

namespace stance {

// Gives the rig its samples' weights (N, J): to each vertex those of the sample whose geodesic Voronoi cell
// it lies in, and to Rig::sampled all of them, of which ScreenedSmoother makes smooth ones.
void BindBySamples(SurfaceSamples samples, RowMatrix weights, Rig& rig);

}  // namespace stance
