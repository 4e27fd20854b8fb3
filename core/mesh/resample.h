// A mesh of any resolution as a fixed number of surface samples with a one-ring of their own.
//
// Networks whose neighbourhoods count vertices depend on vertex density (paper A, section 4.2.6). They see
// these samples instead; what they say of a sample reaches the vertices of its geodesic Voronoi cell.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/types.h"
#include "core/mesh/surface_graph.h"
#include "core/mesh/triangle_mesh.h"

namespace stance {

// A point of a mesh's surface: barycentric weights, which sum to 1, over the corners of a triangle; at a
// vertex or on an edge the rest have the weight 0.
struct SurfacePlace {
  std::array<int32_t, 3> corner;
  std::array<float, 3> weight;
};

// (N, C): vertex values (V, C) at the places, interpolated linearly.
RowMatrix ValuesAt(const RowMatrix& rows, const std::vector<SurfacePlace>& places);

struct SurfaceSamples {
  Points points;           // (N, 3), in farthest-point order
  Points normals;          // (N, 3) unit, area-weighted over the faces; zero where no face has an area
  SurfaceGraph graph;      // over the N samples: those whose cells touch, metres along the surface
  NeighborTable one_ring;  // (N, R): samples whose cells touch, padded with the sample itself
  std::vector<SurfacePlace> place;  // (N) where each sample lies on the mesh
  std::vector<int32_t> cell;  // (V) the sample nearest to each vertex along the surface; of the unreached,
                              // that of the nearest point in space
  std::vector<int32_t> unreached;  // ascending: the vertices of components without a sample, and those
                                   // without a face
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

// Up to `count` samplings of one surface, the first of them ResampleSurface's. No two share a place, so that
// what is estimated from each errs on its own; each is as even as those before it leave it. Fewer where the
// refined surface has too few points for another. REQUIRES: count >= 1; the mesh has passed CheckMesh.
std::vector<SurfaceSamples> ResampleSurfaceRepeatedly(const TriangleMesh& mesh, int count,
                                                      const ResampleOptions& options = {});

// All samples of several samplings of one mesh, in order. A vertex's cell is still that of the first
// sampling; there is no graph and no one-ring. REQUIRES: at least one.
SurfaceSamples JoinedSamples(std::vector<SurfaceSamples> samplings);

// The vertices that have a face, in their order, as samples with the mesh's own one-ring: what paper A's
// networks see at full resolution. REQUIRES: the mesh has passed CheckMesh.
SurfaceSamples VertexSamples(const TriangleMesh& mesh, int max_ring = 16);

}  // namespace stance
