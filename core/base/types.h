// Matrix types that every part of Stance shares. Shape letters: B batch, V vertices, F faces, N samples,
// J joints, K neighbours, C channels.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace stance {

// (V, 3), row = vertex (or sample, or joint), metres unless a comment says "normalised".
using Points = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
// (F, 3), row = face, counter-clockwise seen from outside; indices into the rows of a Points.
using Faces = Eigen::Matrix<int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;
// (V, 2), texture coordinates, origin at the lower left (OBJ's convention).
using TexCoords = Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor>;
// (V, J) skinning weights or (V, C) features, row = vertex.
using RowMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
// (V, K) neighbours of each row, as row indices.
using NeighborTable = Eigen::Matrix<int32_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace stance
