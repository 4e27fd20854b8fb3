#include "core/mesh/mesh_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace stance {
namespace {

constexpr float kLargestCoordinate = 1e6f;  // metres
// A triangle flatter than this fraction of its longest edge can't be told from a line in float32.
constexpr double kDegenerateHeight = 1e-6;

absl::Status CheckCounts(const TriangleMesh& mesh, const MeshLimits& limits) {
  if (mesh.vertex_count() == 0) return absl::InvalidArgumentError("the mesh has no vertices");
  STANCE_RETURN_IF_ERROR(CheckLimits(mesh.vertex_count(), mesh.face_count(), limits));
  if (mesh.face_count() == 0) return absl::InvalidArgumentError("the mesh has no faces");
  if (mesh.normals.rows() != 0 && mesh.normals.rows() != mesh.vertex_count()) {
    return absl::InvalidArgumentError(
        fmt::format("the mesh has {} normals for {} vertices", mesh.normals.rows(), mesh.vertex_count()));
  }
  if (mesh.texcoords.rows() != 0 && mesh.texcoords.rows() != mesh.vertex_count()) {
    return absl::InvalidArgumentError(fmt::format("the mesh has {} texture coordinates for {} vertices",
                                                  mesh.texcoords.rows(), mesh.vertex_count()));
  }
  return absl::OkStatus();
}

absl::Status CheckCoordinates(const Points& positions) {
  Eigen::RowVector3f low = positions.row(0), high = positions.row(0);
  for (int64_t v = 0; v < positions.rows(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const float value = positions(v, axis);
      if (!std::isfinite(value)) {
        return absl::InvalidArgumentError(
            fmt::format("vertex {} has a non-finite coordinate ({} = {})", v, "xyz"[axis], value));
      }
      if (std::abs(value) > kLargestCoordinate) {
        return absl::InvalidArgumentError(fmt::format("vertex {} lies too far out ({} = {}; at most {} m)", v,
                                                      "xyz"[axis], value, kLargestCoordinate));
      }
      low[axis] = std::min(low[axis], value);
      high[axis] = std::max(high[axis], value);
    }
  }
  if (low == high) {
    return absl::InvalidArgumentError(
        fmt::format("the mesh has no extent: all {} vertices lie at ({}, {}, {})", positions.rows(), low[0],
                    low[1], low[2]));
  }
  return absl::OkStatus();
}

absl::Status CheckIndices(const Faces& faces, int64_t vertex_count) {
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int32_t index = faces(f, corner);
      if (index < 0 || index >= vertex_count) {
        return absl::InvalidArgumentError(
            fmt::format("face {} names vertex {}, but the mesh has {} vertices", f, index, vertex_count));
      }
    }
  }
  return absl::OkStatus();
}

bool IsDegenerate(const Points& positions, const Faces& faces, int64_t f) {
  const Eigen::RowVector3i face = faces.row(f);
  if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) return true;
  const Eigen::Vector3d a = positions.row(face[0]).transpose().cast<double>();
  const Eigen::Vector3d ab = positions.row(face[1]).transpose().cast<double>() - a;
  const Eigen::Vector3d ac = positions.row(face[2]).transpose().cast<double>() - a;
  const double longest2 = std::max({ab.squaredNorm(), ac.squaredNorm(), (ab - ac).squaredNorm()});
  return ab.cross(ac).norm() <= kDegenerateHeight * longest2;
}

// "1 degenerate face" or "3 degenerate faces".
std::string Counted(int64_t count, const char* adjective_and_noun) {
  return fmt::format("{} {}{}", count, adjective_and_noun, count == 1 ? "" : "s");
}

void ReportDegenerateFaces(const TriangleMesh& mesh, MeshReport& report) {
  int64_t first = -1;
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    if (!IsDegenerate(mesh.positions, mesh.faces, f)) continue;
    if (report.degenerate_faces++ == 0) first = f;
  }
  if (report.degenerate_faces > 0) {
    report.warnings.push_back(
        fmt::format("{} (first: face {})", Counted(report.degenerate_faces, "degenerate face"), first));
  }
}

// Union-find with path halving; a union hangs the later vertex below the earlier, so that roots are stable.
int32_t Root(std::vector<int32_t>& parent, int32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

void ReportComponents(const TriangleMesh& mesh, MeshReport& report) {
  std::vector<int32_t> parent(mesh.vertex_count());
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<bool> referenced(mesh.vertex_count(), false);
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      referenced[mesh.faces(f, corner)] = true;
      const int32_t a = Root(parent, mesh.faces(f, corner));
      const int32_t b = Root(parent, mesh.faces(f, (corner + 1) % 3));
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  int64_t first = -1;
  for (int32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (!referenced[v]) {
      if (report.unreferenced_vertices++ == 0) first = v;
    } else if (parent[v] == v) {
      ++report.components;
    }
  }
  if (report.unreferenced_vertices > 0) {
    report.warnings.push_back(fmt::format("{} unreferenced {} (first: vertex {})",
                                          report.unreferenced_vertices,
                                          report.unreferenced_vertices == 1 ? "vertex" : "vertices", first));
  }
  if (report.components > 1) report.warnings.push_back(Counted(report.components, "component"));
}

// Counts the faces at each edge: edges are bucketed by their lower vertex, each small bucket is sorted.
void ReportNonManifoldEdges(const TriangleMesh& mesh, MeshReport& report) {
  const auto for_each_edge = [&mesh](auto&& visit) {
    for (int64_t f = 0; f < mesh.face_count(); ++f) {
      for (int corner = 0; corner < 3; ++corner) {
        const int32_t a = mesh.faces(f, corner), b = mesh.faces(f, (corner + 1) % 3);
        if (a != b) visit(std::min(a, b), std::max(a, b));
      }
    }
  };
  std::vector<int64_t> start(mesh.vertex_count() + 1, 0);
  for_each_edge([&](int32_t low, int32_t) { ++start[low + 1]; });
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<int32_t> high(start.back());
  std::vector<int64_t> next(start.begin(), start.end() - 1);
  for_each_edge([&](int32_t low, int32_t other) { high[next[low]++] = other; });

  int32_t first_low = -1, first_high = -1;
  for (int32_t low = 0; low < mesh.vertex_count(); ++low) {
    const auto end = high.begin() + start[low + 1];
    std::sort(high.begin() + start[low], end);
    for (auto run = high.begin() + start[low]; run != end;) {
      const auto run_end = std::find_if(run, end, [&](int32_t v) { return v != *run; });
      if (run_end - run > 2 && report.non_manifold_edges++ == 0) {
        first_low = low;
        first_high = *run;
      }
      run = run_end;
    }
  }
  if (report.non_manifold_edges > 0) {
    report.warnings.push_back(fmt::format("{} (first: between vertices {} and {})",
                                          Counted(report.non_manifold_edges, "non-manifold edge"), first_low,
                                          first_high));
  }
}

// Warns of the first row that is not finite.
template <typename Attribute>
void ReportAttribute(const Attribute& rows, const char* name, MeshReport& report) {
  if (rows.allFinite()) return;
  int64_t v = 0;
  while (rows.row(v).allFinite()) ++v;
  report.warnings.push_back(
      fmt::format("vertex {0} has a {1} that is not finite; the {1}s are left out", v, name));
}

}  // namespace

absl::Status CheckLimits(int64_t vertices, int64_t faces, const MeshLimits& limits) {
  if (vertices > limits.max_vertices) {
    return absl::InvalidArgumentError(
        fmt::format("the mesh has {} vertices; at most {} are accepted", vertices, limits.max_vertices));
  }
  if (faces > limits.max_faces) {
    return absl::InvalidArgumentError(
        fmt::format("the mesh has {} faces; at most {} are accepted", faces, limits.max_faces));
  }
  return absl::OkStatus();
}

absl::StatusOr<MeshReport> CheckMesh(const TriangleMesh& mesh, const MeshLimits& limits) {
  STANCE_RETURN_IF_ERROR(CheckCounts(mesh, limits));
  STANCE_RETURN_IF_ERROR(CheckCoordinates(mesh.positions));
  STANCE_RETURN_IF_ERROR(CheckIndices(mesh.faces, mesh.vertex_count()));
  MeshReport report;
  ReportDegenerateFaces(mesh, report);
  ReportComponents(mesh, report);
  ReportNonManifoldEdges(mesh, report);
  ReportAttribute(mesh.normals, "normal", report);
  ReportAttribute(mesh.texcoords, "texture coordinate", report);
  return report;
}

void DropBrokenAttributes(TriangleMesh& mesh) {
  if (!mesh.normals.allFinite()) mesh.normals.resize(0, 3);
  if (!mesh.texcoords.allFinite()) mesh.texcoords.resize(0, 2);
}

}  // namespace stance
