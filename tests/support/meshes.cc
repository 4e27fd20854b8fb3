#include "tests/support/meshes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "core/base/check.h"
#include "core/base/random.h"

namespace stance::testing {
namespace {

constexpr float kPi = 3.14159265358979f;

TriangleMesh Assemble(const std::vector<Eigen::Vector3f>& positions,
                      const std::vector<std::array<int, 3>>& faces) {
  TriangleMesh mesh;
  mesh.positions.resize(static_cast<int64_t>(positions.size()), 3);
  for (size_t v = 0; v < positions.size(); ++v) mesh.positions.row(v) = positions[v].transpose();
  mesh.faces.resize(static_cast<int64_t>(faces.size()), 3);
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.row(f) << faces[f][0], faces[f][1], faces[f][2];
  return mesh;
}

}  // namespace

TriangleMesh Icosphere(int level, float radius) {
  const float t = (1.0f + std::sqrt(5.0f)) / 2.0f;
  std::vector<Eigen::Vector3f> positions = {{-1, t, 0}, {1, t, 0}, {-1, -t, 0}, {1, -t, 0},
                                            {0, -1, t}, {0, 1, t}, {0, -1, -t}, {0, 1, -t},
                                            {t, 0, -1}, {t, 0, 1}, {-t, 0, -1}, {-t, 0, 1}};
  std::vector<std::array<int, 3>> faces = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                           {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                           {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                           {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int step = 0; step < level; ++step) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, added] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(positions.size()));
      if (added) positions.push_back((positions[a] + positions[b]) / 2);
      return place->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    faces = std::move(finer);
    for (Eigen::Vector3f& p : positions) p.normalize();
  }
  for (Eigen::Vector3f& p : positions) p = radius * p.normalized();
  return Assemble(positions, faces);
}

TriangleMesh Box(float x, float y, float z) {
  return Assemble({{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}, {0, 0, z}, {x, 0, z}, {x, y, z}, {0, y, z}},
                  {{0, 2, 1},
                   {0, 3, 2},
                   {4, 5, 6},
                   {4, 6, 7},
                   {0, 1, 5},
                   {0, 5, 4},
                   {2, 3, 7},
                   {2, 7, 6},
                   {1, 2, 6},
                   {1, 6, 5},
                   {3, 0, 4},
                   {3, 4, 7}});
}

TriangleMesh Grid(int columns, int rows) {
  std::vector<Eigen::Vector3f> positions;
  std::vector<std::array<int, 3>> faces;
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      positions.emplace_back(static_cast<float>(c) / columns, static_cast<float>(r) / rows, 0.0f);
    }
  }
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int v = r * (columns + 1) + c, above = v + columns + 1;
      faces.push_back({v, v + 1, above + 1});
      faces.push_back({v, above + 1, above});
    }
  }
  return Assemble(positions, faces);
}

TriangleMesh Capsule(float length, float radius, int segments, int rings, int tubes) {
  // Circles from the bottom to the top; the two poles close them.
  std::vector<Eigen::Vector3f> positions = {{0, -length / 2 - radius, 0}};
  const auto circle = [&](float r, float y) {
    for (int s = 0; s < segments; ++s) {
      const float angle = 2 * kPi * static_cast<float>(s) / static_cast<float>(segments);
      positions.emplace_back(r * std::cos(angle), y, r * std::sin(angle));
    }
  };
  for (int k = 1; k <= rings; ++k) {
    const float a = kPi / 2 * static_cast<float>(k) / static_cast<float>(rings);
    circle(radius * std::sin(a), -length / 2 - radius * std::cos(a));
  }
  for (int k = 1; k < tubes; ++k) circle(radius, length * (static_cast<float>(k) / tubes - 0.5f));
  for (int k = rings; k >= 1; --k) {
    const float a = kPi / 2 * static_cast<float>(k) / static_cast<float>(rings);
    circle(radius * std::sin(a), length / 2 + radius * std::cos(a));
  }
  positions.emplace_back(0, length / 2 + radius, 0);

  const int circles = 2 * rings + tubes - 1, top = static_cast<int>(positions.size()) - 1;
  const auto at = [&](int k, int s) { return 1 + k * segments + s % segments; };
  std::vector<std::array<int, 3>> faces;
  for (int s = 0; s < segments; ++s) {
    faces.push_back({0, at(0, s), at(0, s + 1)});
    for (int k = 0; k + 1 < circles; ++k) {
      faces.push_back({at(k, s), at(k + 1, s), at(k + 1, s + 1)});
      faces.push_back({at(k, s), at(k + 1, s + 1), at(k, s + 1)});
    }
    faces.push_back({top, at(circles - 1, s + 1), at(circles - 1, s)});
  }
  return Assemble(positions, faces);
}

TriangleMesh Fan(int blades) {
  std::vector<Eigen::Vector3f> positions = {{0, 0, 0}, {0, 1, 0}};
  std::vector<std::array<int, 3>> faces;
  for (int k = 0; k < blades; ++k) {
    const float angle = 2 * kPi * static_cast<float>(k) / static_cast<float>(blades);
    positions.emplace_back(std::cos(angle), 0.5f, std::sin(angle));
    faces.push_back({0, 1, 2 + k});
  }
  return Assemble(positions, faces);
}

TriangleMesh Together(const std::vector<TriangleMesh>& meshes) {
  TriangleMesh all;
  for (const TriangleMesh& mesh : meshes) {
    const int64_t vertices = all.vertex_count(), faces = all.face_count();
    all.positions.conservativeResize(vertices + mesh.vertex_count(), 3);
    all.positions.bottomRows(mesh.vertex_count()) = mesh.positions;
    all.faces.conservativeResize(faces + mesh.face_count(), 3);
    all.faces.bottomRows(mesh.face_count()) = mesh.faces.array() + static_cast<int32_t>(vertices);
  }
  return all;
}

TriangleMesh Shifted(TriangleMesh mesh, const Eigen::RowVector3f& offset) {
  mesh.positions.rowwise() += offset;
  return mesh;
}

TriangleMesh TwoSpheres(int level) {
  return Together({Icosphere(level), Shifted(Icosphere(level), {3, 0, 0})});
}

TriangleMesh TwoPlates(int cells, float gap) {
  return Together({Grid(cells, cells), Shifted(Grid(cells, cells), {0, 0, gap})});
}

TriangleMesh Coil(float gap, float radius, float winding, int segments, int sections) {
  const int circles = 2 * sections + 1;
  std::vector<Eigen::Vector3f> positions;
  const auto place = [&](float turn, float out, float up) {
    const float angle = 2 * kPi * turn;
    positions.emplace_back((winding + out) * std::cos(angle), (2 * radius + gap) * turn + up,
                           (winding + out) * std::sin(angle));
  };
  for (int k = 0; k < circles; ++k) {
    for (int s = 0; s < segments; ++s) {
      const float angle = 2 * kPi * static_cast<float>(s) / static_cast<float>(segments);
      place(static_cast<float>(k) / static_cast<float>(sections), radius * std::cos(angle),
            radius * std::sin(angle));
    }
  }
  place(0, 0, 0);
  place(2, 0, 0);

  const int first = circles * segments, last = first + 1;
  const auto at = [&](int k, int s) { return k * segments + s % segments; };
  std::vector<std::array<int, 3>> faces;
  for (int s = 0; s < segments; ++s) {
    faces.push_back({first, at(0, s), at(0, s + 1)});
    for (int k = 0; k + 1 < circles; ++k) {
      faces.push_back({at(k, s), at(k + 1, s), at(k + 1, s + 1)});
      faces.push_back({at(k, s), at(k + 1, s + 1), at(k, s + 1)});
    }
    faces.push_back({last, at(circles - 1, s + 1), at(circles - 1, s)});
  }
  return Assemble(positions, faces);
}

TriangleMesh WithDegenerateFaces() {
  TriangleMesh mesh = Icosphere(1);
  const int32_t middle = static_cast<int32_t>(mesh.vertex_count()), twin = middle + 1;
  const Eigen::RowVector3i face = mesh.faces.row(0);
  mesh.positions.conservativeResize(twin + 1, 3);
  mesh.positions.row(middle) = (mesh.positions.row(face[0]) + mesh.positions.row(face[1])) / 2;
  mesh.positions.row(twin) = mesh.positions.row(face[0]);
  const int64_t count = mesh.face_count();
  mesh.faces.conservativeResize(count + 3, 3);
  mesh.faces.row(count) << face[0], face[1], face[0];
  mesh.faces.row(count + 1) << face[0], middle, face[1];
  mesh.faces.row(count + 2) << face[0], twin, face[2];
  return mesh;
}

TriangleMesh Unwelded(const TriangleMesh& mesh) {
  TriangleMesh result;
  result.positions.resize(3 * mesh.face_count(), 3);
  result.faces.resize(mesh.face_count(), 3);
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      result.positions.row(3 * f + corner) = mesh.positions.row(mesh.faces(f, corner));
      result.faces(f, corner) = static_cast<int32_t>(3 * f + corner);
    }
  }
  return result;
}

TriangleMesh Shuffled(const TriangleMesh& mesh, uint64_t seed, std::vector<int32_t>* order_out) {
  std::vector<int32_t> order(mesh.vertex_count());
  std::iota(order.begin(), order.end(), 0);
  Random random(seed);
  for (int64_t v = mesh.vertex_count() - 1; v > 0; --v) std::swap(order[v], order[random.Below(v + 1)]);

  TriangleMesh result = mesh;
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    result.positions.row(order[v]) = mesh.positions.row(v);
    if (mesh.normals.rows() > 0) result.normals.row(order[v]) = mesh.normals.row(v);
    if (mesh.texcoords.rows() > 0) result.texcoords.row(order[v]) = mesh.texcoords.row(v);
  }
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    for (int corner = 0; corner < 3; ++corner) result.faces(f, corner) = order[mesh.faces(f, corner)];
  }
  if (order_out != nullptr) *order_out = std::move(order);
  return result;
}

TriangleMesh WithAttributes(TriangleMesh mesh) {
  STANCE_CHECK(mesh.face_count() >= 2);
  const Eigen::RowVector3f centre = mesh.positions.colwise().mean();
  mesh.normals = (mesh.positions.rowwise() - centre).rowwise().normalized();
  mesh.texcoords.resize(mesh.vertex_count(), 2);
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    mesh.texcoords.row(v) << static_cast<float>(v) / static_cast<float>(mesh.vertex_count()),
        0.25f + 0.5f * mesh.normals(v, 1) * mesh.normals(v, 1);
  }
  const int64_t half = mesh.face_count() / 2;
  mesh.groups = {{"upper", 0, half}, {"lower", half, mesh.face_count() - half}};
  return mesh;
}

}  // namespace stance::testing
