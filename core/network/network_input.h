// What networks see of a mesh: normalised surface samples. Free of Torch.
#pragma once

#include "core/base/types.h"

namespace stance {

// normalised = (metres - center) / scale; the centre and the diagonal of the bounding box.
struct Normalization {
  Eigen::RowVector3f center = Eigen::RowVector3f::Zero();
  float scale = 1.0f;

  Points Apply(const Points& metres) const { return (metres.rowwise() - center) / scale; }
  Points Invert(const Points& normalized) const { return (normalized * scale).rowwise() + center; }
};

// REQUIRES: points has rows. A cloud of zero extent keeps scale 1.
Normalization NormalizationOf(const Points& points);

struct NetworkInput {
  Points points;           // (N, 3) in the mesh's unit; the network normalises them
  NeighborTable one_ring;  // (N, R), padded with the row itself
};

}  // namespace stance
