// Linear blend skinning (paper A, equation 10).
#pragma once

#include "core/transfer/parts.h"

namespace stance {

// u_i = sum_j W_ij T_j v_i.
class LinearBlendSkinning : public Deformer {
 public:
  Points Deform(const Points& vertices, const RowMatrix& weights,
                std::span<const AffineTransform> transforms) const override;
};

// Unit normals (V, 3) turned by the blended rotations; zero normals stay zero.
Points DeformNormals(const Points& normals, const RowMatrix& weights,
                     std::span<const AffineTransform> transforms);

}  // namespace stance
