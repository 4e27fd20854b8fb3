// Transfer pairs made harder, each with the truth that belongs to it.
#pragma once

#include <cstdint>

#include "core/base/random.h"
#include "core/training/character.h"

namespace stance {

// All change both characters of the pair, whose positions are metres, and the same `random` disturbs a pair
// the same way at every strength: only more. What the meshes keep for output (normals, texture coordinates,
// groups) is dropped where vertices or faces change.

// Both meshes at `count` vertices: fewer by collapsing edges onto their ends (decimation.h), more by
// midpoints of edges (subdivision.h), which have their parents' mean weights, canonical place and truth. A
// mesh that can't be made so coarse has more vertices; one that has `count` to within a factor of
// `keep_within` (>= 1) stays as it is.
TransferPair Remeshed(TransferPair pair, int64_t count, double keep_within = 1);

// Each vertex moved along its normal by a normal deviate, `deviation` its standard deviation in statures. The
// truth's vertices move by the source's offsets, turned as skinning with the true weights and rotations turns
// them: by sum_j w_j R_j.
TransferPair WithNoise(TransferPair pair, double deviation, Random& random);

// Round holes that together hold `share` of the area (CutShare, which see). Vertices left without a face are
// gone, from the truth too.
TransferPair WithHoles(TransferPair pair, double share, Random& random);

// Each body turned by `angle` radians about its own pelvis, both about the same random horizontal axis. The
// truth turns with the reference, so its pelvis stays where the source's is.
TransferPair Tilted(TransferPair pair, double angle, Random& random);

}  // namespace stance
