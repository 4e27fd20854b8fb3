// A mesh of any resolution as a fixed number of surface samples with a one-ring of their own.
//
// Networks whose neighbourhoods count vertices depend on vertex density (paper A, section 4.2.6). They see
// these samples instead; what they say of a sample reaches the vertices of its geodesic Voronoi cell.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/types.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

struct SurfaceSamples {
  Points points;                // (N, 3), in farthest-point order
  NeighborTable one_ring;       // (N, R): samples whose cells touch, padded with the sample itself
  std::vector<int32_t> vertex;  // (N) the vertex that each sample is; where it lies inside a triangle or on
                                // an edge, the nearest of its corners
  std::vector<int32_t> cell;  // (V) the sample nearest to each vertex along the surface; nearest in space on
                              // components without a sample, and for unreferenced vertices
};

struct ResampleOptions {
  int64_t samples = 1024;
  // Neighbours kept of a sample's one-ring, nearest first; cells have six on average.
  int max_ring = 12;
};

// Farthest-point samples of the surface, evenly spaced whatever the triangulation: long edges are split
// first, dense regions thinned. Vertices without a face are no part of the surface. Does not depend on the
// order of the vertices (except among exact ties) nor on a rigid motion. Fewer than options.samples only
// where the refined surface has fewer distinct points. REQUIRES: the mesh has passed CheckMesh.
SurfaceSamples ResampleSurface(const TriangleMesh& mesh, const ResampleOptions& options = {});

// The vertices that have a face, in their order, as samples with the mesh's own one-ring: what paper A's
// networks see at full resolution. REQUIRES: the mesh has passed CheckMesh.
SurfaceSamples VertexSamples(const TriangleMesh& mesh, int max_ring = 16);

}  // namespace stance
