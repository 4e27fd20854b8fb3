// Areas, extents and the stature that scales follow from.
#pragma once

#include "core/base/types.h"

namespace stance {

// Sum of the faces' areas, m^2.
double SurfaceArea(const Points& positions, const Faces& faces);

// (V) a third of the area of each vertex's faces, m^2.
Eigen::VectorXd VertexAreas(const Points& positions, const Faces& faces);

// A human's height in metres (the mesh's unit) judged from its surface, whatever its pose: 1.22 sqrt(area),
// the ratio of MakeHuman's neutral body. Layers of clothes make it some 10 % too large.
double EstimateStature(const Points& positions, const Faces& faces);

// (V, 3) unit vertex normals, faces weighted by area; zero where a vertex has no proper face.
Points VertexNormals(const Points& positions, const Faces& faces);

}  // namespace stance
