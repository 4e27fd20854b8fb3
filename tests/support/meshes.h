// Generated meshes, chosen by property. Faces are counter-clockwise seen from outside; units are metres.
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace stance::testing {

// Closed, manifold, genus 0: an icosahedron subdivided `level` times, every vertex at `radius` from the
// origin. 10 * 4^level + 2 vertices, 20 * 4^level faces.
TriangleMesh Icosphere(int level, float radius = 1.0f);

// Closed, with sharp edges: the box [0, x] x [0, y] x [0, z] with 8 vertices and 12 faces.
TriangleMesh Box(float x = 1.0f, float y = 1.0f, float z = 1.0f);

// Open, with a boundary: (columns + 1) x (rows + 1) vertices over [0, 1]^2 in the plane z = 0, row by row,
// normals to +z, all triangles equal.
TriangleMesh Grid(int columns, int rows);

// Closed and elongated: a cylinder of `length` along y between two hemispheres, centred at the origin.
// 2 + segments * (2 * rings + tubes - 1) vertices: per hemisphere `rings` circles, the tube in `tubes`
// pieces.
TriangleMesh Capsule(float length = 1.0f, float radius = 0.25f, int segments = 16, int rings = 4,
                     int tubes = 8);

// Non-manifold: `blades` (>= 3) triangles around the one edge between vertices 0 and 1; 2 + blades vertices.
TriangleMesh Fan(int blades = 3);

// Two components: icospheres of `level` beside each other, a gap of one radius between them.
TriangleMesh TwoSpheres(int level = 1);

// Two open components: grids of `cells` x `cells` over [0, 1]^2, one in the plane z = 0, the other `gap`
// above it. Each has half of the vertices and of the faces.
TriangleMesh TwoPlates(int cells, float gap);

// Closed, one component that touches itself: a tube of `radius` wound twice about the y axis at `winding`
// from it, its turns `gap` apart (they interpenetrate where it is negative), its ends closed by a vertex
// each. `sections` circles a turn of `segments` vertices each, from one end to the other: vertex v is of
// circle v / segments (2 * sections + 1 of them); the last two vertices are the ends.
TriangleMesh Coil(float gap, float radius = 0.05f, float winding = 0.3f, int segments = 24,
                  int sections = 120);

// All of them in one mesh, in their order, without attributes.
TriangleMesh Together(const std::vector<TriangleMesh>& meshes);

// The mesh moved.
TriangleMesh Shifted(TriangleMesh mesh, const Eigen::RowVector3f& offset);

// An icosphere of level 1 with faces 80..82 added: a repeated index, three vertices on a line (one of them,
// the last vertex, new, in the middle of an edge), and a face of zero area with two coincident corners.
TriangleMesh WithDegenerateFaces();

// The same surface with every corner its own vertex, as STL stores it: 3 F vertices, F components.
TriangleMesh Unwelded(const TriangleMesh& mesh);

// `mesh` with its vertices reordered: vertex v of the argument is vertex order[v] of the result, with `order`
// a random permutation made from the seed. `order_out`, if not null, receives it.
TriangleMesh Shuffled(const TriangleMesh& mesh, uint64_t seed, std::vector<int32_t>* order_out = nullptr);

// `mesh` with per-vertex normals, texture coordinates and two groups, "upper" and "lower" (half the faces
// each).
TriangleMesh WithAttributes(TriangleMesh mesh);

}  // namespace stance::testing
