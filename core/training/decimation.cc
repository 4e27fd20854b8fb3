#include "core/training/decimation.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModEdgeLengthT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <cmath>
#include <numeric>

#include "core/mesh/measure.h"

namespace stance {
namespace {

using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;

// Longest edge that may collapse, in edges of an even triangulation with the level's number of vertices: the
// quadric error alone would leave flat limbs with slivers and spend every vertex on the face.
constexpr double kLongestCollapse = 1.0;

Mesh MakeMesh(const Points& vertices, const Faces& faces) {
  Mesh mesh;
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    mesh.add_vertex({vertices(v, 0), vertices(v, 1), vertices(v, 2)});
  }
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    mesh.add_face(Mesh::VertexHandle(faces(f, 0)), Mesh::VertexHandle(faces(f, 1)),
                  Mesh::VertexHandle(faces(f, 2)));
  }
  mesh.request_vertex_status();
  mesh.request_edge_status();
  mesh.request_halfedge_status();
  mesh.request_face_status();
  mesh.request_face_normals();
  mesh.update_face_normals();
  return mesh;
}

// The surviving vertices and faces; handles are stable until garbage collection, which never runs.
BodyTopology Survivors(const Mesh& mesh) {
  BodyTopology level;
  std::vector<int32_t> index(mesh.n_vertices(), -1);
  for (const Mesh::VertexHandle v : mesh.all_vertices()) {
    if (mesh.status(v).deleted() || mesh.is_isolated(v)) continue;
    index[v.idx()] = static_cast<int32_t>(level.vertices.size());
    level.vertices.push_back(v.idx());
  }
  std::vector<int32_t> corners;
  for (const Mesh::FaceHandle f : mesh.all_faces()) {
    if (mesh.status(f).deleted()) continue;
    for (const Mesh::VertexHandle v : mesh.fv_range(f)) corners.push_back(index[v.idx()]);
  }
  level.faces = Eigen::Map<const Faces>(corners.data(), static_cast<Eigen::Index>(corners.size() / 3), 3);
  return level;
}

}  // namespace

std::vector<BodyTopology> BuildLevels(const Points& vertices, const Faces& faces,
                                      const std::vector<int>& targets) {
  std::vector<BodyTopology> levels(1);
  levels[0].vertices.resize(vertices.rows());
  std::iota(levels[0].vertices.begin(), levels[0].vertices.end(), 0);
  levels[0].faces = faces;

  Mesh mesh = MakeMesh(vertices, faces);
  OpenMesh::Decimater::DecimaterT<Mesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  OpenMesh::Decimater::ModEdgeLengthT<Mesh>::Handle length;
  OpenMesh::Decimater::ModNormalFlippingT<Mesh>::Handle flipping;
  decimater.add(quadric);
  decimater.module(quadric).unset_max_err();  // the error is the priority
  decimater.add(length);
  decimater.module(length).set_binary(true);
  decimater.add(flipping);
  decimater.module(flipping).set_max_normal_deviation(60);
  decimater.initialize();
  const double area = SurfaceArea(vertices, faces);
  for (const int target : targets) {
    // decimate_to() would count the vertices that an earlier level removed.
    const auto surplus = static_cast<int64_t>(levels.back().vertices.size()) - target;
    if (surplus <= 0) continue;
    decimater.module(length).set_edge_length(
        static_cast<float>(kLongestCollapse * std::sqrt(2 * area / (std::sqrt(3.0) * target))));
    decimater.decimate(static_cast<size_t>(surplus));
    levels.push_back(Survivors(mesh));
  }
  return levels;
}

}  // namespace stance
