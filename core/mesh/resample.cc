#include "core/mesh/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <unordered_map>
#include <utility>

#include "core/mesh/farthest_point.h"
#include "core/mesh/measure.h"
#include "core/mesh/nearest_rows.h"
#include "core/mesh/surface_graph.h"

namespace stance {
namespace {

// A working copy whose first V rows are the mesh's own vertices.
struct Refined {
  Points positions;
  Faces faces;
  std::vector<SurfacePlace> added;  // of row V + i

  SurfacePlace PlaceOf(int64_t row) const {
    const int64_t own = positions.rows() - static_cast<int64_t>(added.size());
    if (row >= own) return added[row - own];
    const auto vertex = static_cast<int32_t>(row);
    return {{vertex, vertex, vertex}, {1, 0, 0}};
  }
};

// Half way between two places of one triangle, as both ends of an edge of a refined triangle are.
SurfacePlace Middle(const SurfacePlace& a, const SurfacePlace& b) {
  SurfacePlace middle = a;
  for (float& weight : middle.weight) weight *= 0.5f;
  for (int i = 0; i < 3; ++i) {
    if (b.weight[i] == 0) continue;
    int slot = 0;
    while (slot < 2 && middle.weight[slot] > 0 && middle.corner[slot] != b.corner[i]) ++slot;
    middle.corner[slot] = b.corner[i];
    middle.weight[slot] += 0.5f * b.weight[i];
  }
  return middle;
}

// Splits every edge longer than `limit` at its middle, once; true if any was. A split edge is split in all
// its faces, so cracks do not open, on manifold meshes and others.
bool SplitLongEdges(Refined& mesh, float limit) {
  std::unordered_map<uint64_t, int32_t> middle;
  std::vector<Eigen::RowVector3f> added;
  std::vector<SurfacePlace> added_places;
  const auto split = [&](int32_t a, int32_t b) -> int32_t {
    const Eigen::RowVector3f pa = mesh.positions.row(a), pb = mesh.positions.row(b);
    if ((pa - pb).norm() <= limit) return -1;
    const uint64_t key =
        (static_cast<uint64_t>(std::min(a, b)) << 32) | static_cast<uint32_t>(std::max(a, b));
    const auto [it, fresh] = middle.try_emplace(
        key, static_cast<int32_t>(mesh.positions.rows() + static_cast<int64_t>(added.size())));
    if (fresh) {
      added.push_back(0.5f * (pa + pb));
      added_places.push_back(Middle(mesh.PlaceOf(a), mesh.PlaceOf(b)));
    }
    return it->second;
  };
  std::vector<int32_t> out;
  out.reserve(mesh.faces.size() * 2);
  const auto emit = [&](int32_t a, int32_t b, int32_t c) { out.insert(out.end(), {a, b, c}); };
  for (int64_t f = 0; f < mesh.faces.rows(); ++f) {
    int32_t v[3] = {mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2)};
    int32_t m[3] = {split(v[0], v[1]), split(v[1], v[2]), split(v[2], v[0])};  // m[i] halves edge i, i + 1
    const int splits = (m[0] >= 0) + (m[1] >= 0) + (m[2] >= 0);
    if (splits == 0) {
      emit(v[0], v[1], v[2]);
    } else if (splits == 3) {
      emit(v[0], m[0], m[2]);
      emit(v[1], m[1], m[0]);
      emit(v[2], m[2], m[1]);
      emit(m[0], m[1], m[2]);
    } else if (splits == 1) {
      int i = 0;
      while (m[i] < 0) ++i;  // edge i is the split one
      emit(v[i], m[i], v[(i + 2) % 3]);
      emit(m[i], v[(i + 1) % 3], v[(i + 2) % 3]);
    } else {
      int i = 0;
      while (m[i] >= 0) ++i;  // edge i is the whole one; corner i + 2 lies opposite
      const int32_t a = v[i], b = v[(i + 1) % 3], c = v[(i + 2) % 3], bc = m[(i + 1) % 3],
                    ca = m[(i + 2) % 3];
      emit(c, ca, bc);
      emit(a, b, bc);
      emit(a, bc, ca);
    }
  }
  if (added.empty()) return false;
  const int64_t before = mesh.positions.rows();
  mesh.positions.conservativeResize(before + static_cast<int64_t>(added.size()), 3);
  for (size_t i = 0; i < added.size(); ++i) mesh.positions.row(before + static_cast<int64_t>(i)) = added[i];
  mesh.added.insert(mesh.added.end(), added_places.begin(), added_places.end());
  mesh.faces = Eigen::Map<const Faces>(out.data(), static_cast<int64_t>(out.size() / 3), 3);
  return true;
}

// Refines until the edges are shorter than about half the spacing of `samples` even samples. The number of
// rounds is bounded: a needle a thousand times longer than the body isn't worth a million vertices.
Refined Refine(const TriangleMesh& mesh, int64_t samples) {
  Refined refined{mesh.positions, mesh.faces, {}};
  const double area = SurfaceArea(refined.positions, refined.faces);
  if (!(area > 0)) return refined;
  const auto limit = static_cast<float>(0.6 * std::sqrt(area / static_cast<double>(samples)));
  constexpr int kRounds = 8;
  const int64_t most = mesh.vertex_count() + 40 * samples;
  for (int round = 0; round < kRounds && refined.positions.rows() < most; ++round) {
    if (!SplitLongEdges(refined, limit)) break;
  }
  return refined;
}

// The vertices that have a face, ascending.
std::vector<int32_t> ReferencedRows(const Points& positions, const Faces& faces) {
  std::vector<char> used(positions.rows(), 0);
  for (int64_t i = 0; i < faces.size(); ++i) used[faces.data()[i]] = 1;
  std::vector<int32_t> rows;
  for (int64_t v = 0; v < positions.rows(); ++v) {
    if (used[v]) rows.push_back(static_cast<int32_t>(v));
  }
  return rows;
}

// Rows that farthest-point sampling may choose from: the referenced vertices, on dense meshes thinned to one
// (the nearest to its centre) per cell of a grid a quarter of the sample spacing wide.
std::vector<int32_t> Candidates(const Refined& mesh, int64_t samples) {
  std::vector<int32_t> rows = ReferencedRows(mesh.positions, mesh.faces);
  if (static_cast<int64_t>(rows.size()) <= 16 * samples) return rows;
  const double width =
      0.25 * std::sqrt(SurfaceArea(mesh.positions, mesh.faces) / static_cast<double>(samples));
  if (!(width > 0)) return rows;
  Eigen::RowVector3f low = mesh.positions.row(rows[0]);
  for (const int32_t v : rows) low = low.cwiseMin(mesh.positions.row(v));
  std::unordered_map<uint64_t, std::pair<float, int32_t>> best;
  for (const int32_t v : rows) {
    const Eigen::RowVector3d cell = (mesh.positions.row(v) - low).cast<double>() / width;
    const Eigen::RowVector3d index = cell.array().floor().min(2097151.0);  // 21 bits an axis
    const uint64_t key = (static_cast<uint64_t>(index[0]) << 42) | (static_cast<uint64_t>(index[1]) << 21) |
                         static_cast<uint64_t>(index[2]);
    const auto off = static_cast<float>((cell - index).array().operator-(0.5).matrix().squaredNorm());
    const auto [it, fresh] = best.try_emplace(key, off, v);
    if (!fresh && off < it->second.first) it->second = {off, v};
  }
  rows.clear();
  for (const auto& [key, entry] : best) rows.push_back(entry.second);
  std::sort(rows.begin(), rows.end());
  return rows;
}

// The graph's rows as a table of the nearest `max_ring` in space, padded with the row itself.
NeighborTable RingOf(const SurfaceGraph& graph, const Points& points, int max_ring) {
  NeighborTable ring(points.rows(), max_ring);
  std::vector<std::pair<float, int32_t>> row;
  for (int64_t s = 0; s < points.rows(); ++s) {
    row.clear();
    for (int32_t e = graph.start[s]; e < graph.start[s + 1]; ++e) {
      const int32_t neighbor = graph.column[e];
      row.emplace_back((points.row(s) - points.row(neighbor)).squaredNorm(), neighbor);
    }
    std::sort(row.begin(), row.end());
    for (int i = 0; i < max_ring; ++i) {
      ring(s, i) = i < static_cast<int>(row.size()) ? row[i].second : static_cast<int32_t>(s);
    }
  }
  return ring;
}

Points RowsOf(const Points& points, const std::vector<int32_t>& rows) {
  Points out(static_cast<int64_t>(rows.size()), 3);
  for (size_t i = 0; i < rows.size(); ++i) out.row(static_cast<int64_t>(i)) = points.row(rows[i]);
  return out;
}

// The mesh's own vertices' cells; those that no seed reached (-1) take that of the nearest of the `refined`
// rows that one reached. Nearest on the surface, not the nearest sample: samples lie far apart, and a part
// that is worn close to a limb, as a strap is, is nearer to that limb than to another that touches it.
void TakeCells(const Points& refined, const SeedCells& cells, int64_t vertices, SurfaceSamples& samples) {
  samples.cell.assign(cells.seed.begin(), cells.seed.begin() + vertices);
  for (int64_t v = 0; v < vertices; ++v) {
    if (samples.cell[v] < 0) samples.unreached.push_back(static_cast<int32_t>(v));
  }
  if (samples.unreached.empty()) return;
  std::vector<int32_t> reached;
  for (int64_t row = 0; row < refined.rows(); ++row) {
    if (cells.seed[row] >= 0) reached.push_back(static_cast<int32_t>(row));
  }
  const std::vector<int32_t> nearest =
      NearestRow(RowsOf(refined, samples.unreached), RowsOf(refined, reached));
  for (size_t i = 0; i < nearest.size(); ++i) {
    samples.cell[samples.unreached[i]] = cells.seed[reached[nearest[i]]];
  }
}

}  // namespace

RowMatrix ValuesAt(const RowMatrix& rows, const std::vector<SurfacePlace>& places) {
  RowMatrix values(std::ssize(places), rows.cols());
  for (int64_t s = 0; s < values.rows(); ++s) {
    const SurfacePlace& place = places[s];
    values.row(s) = place.weight[0] * rows.row(place.corner[0]) +
                    place.weight[1] * rows.row(place.corner[1]) + place.weight[2] * rows.row(place.corner[2]);
  }
  return values;
}

SurfaceSamples ResampleSurface(const TriangleMesh& mesh, const ResampleOptions& options) {
  return std::move(ResampleSurfaceRepeatedly(mesh, /*count=*/1, options)[0]);
}

std::vector<SurfaceSamples> ResampleSurfaceRepeatedly(const TriangleMesh& mesh, int count,
                                                      const ResampleOptions& options) {
  const Refined refined = Refine(mesh, options.samples);
  const Points normals = VertexNormals(refined.positions, refined.faces);
  const SurfaceGraph surface = BuildSurfaceGraph(refined.positions, refined.faces);
  std::vector<int32_t> candidates = Candidates(refined, options.samples);
  std::vector<SurfaceSamples> samplings;
  for (int i = 0; i < count; ++i) {
    std::vector<int32_t> seeds = FarthestPoints(RowsOf(refined.positions, candidates), options.samples);
    if (i > 0 && std::ssize(seeds) < options.samples) break;
    for (int32_t& seed : seeds) seed = candidates[seed];

    SurfaceSamples samples;
    samples.points = RowsOf(refined.positions, seeds);
    samples.place.reserve(seeds.size());
    for (const int32_t seed : seeds) samples.place.push_back(refined.PlaceOf(seed));
    samples.normals = RowsOf(normals, seeds);
    const SeedCells cells = NearestSeeds(surface, seeds);
    samples.graph = SeedGraph(surface, cells, std::ssize(seeds));
    samples.one_ring = RingOf(samples.graph, samples.points, options.max_ring);
    TakeCells(refined.positions, cells, mesh.vertex_count(), samples);
    samplings.push_back(std::move(samples));

    std::vector<char> taken(refined.positions.rows(), 0);
    for (const int32_t seed : seeds) taken[seed] = 1;
    std::erase_if(candidates, [&](int32_t row) { return taken[row] != 0; });
  }
  return samplings;
}

SurfaceSamples JoinedSamples(std::vector<SurfaceSamples> samplings) {
  SurfaceSamples joined;
  joined.cell = std::move(samplings[0].cell);
  joined.unreached = std::move(samplings[0].unreached);
  int64_t rows = 0;
  for (const SurfaceSamples& samples : samplings) rows += samples.points.rows();
  joined.points.resize(rows, 3);
  joined.normals.resize(rows, 3);
  rows = 0;
  for (const SurfaceSamples& samples : samplings) {
    joined.points.middleRows(rows, samples.points.rows()) = samples.points;
    joined.normals.middleRows(rows, samples.points.rows()) = samples.normals;
    joined.place.insert(joined.place.end(), samples.place.begin(), samples.place.end());
    rows += samples.points.rows();
  }
  return joined;
}

SurfaceSamples VertexSamples(const TriangleMesh& mesh, int max_ring) {
  SurfaceSamples samples;
  const std::vector<int32_t> vertices = ReferencedRows(mesh.positions, mesh.faces);
  for (const int32_t v : vertices) samples.place.push_back({{v, v, v}, {1, 0, 0}});
  samples.points = RowsOf(mesh.positions, vertices);
  samples.normals = RowsOf(VertexNormals(mesh.positions, mesh.faces), vertices);
  const SurfaceGraph surface = BuildSurfaceGraph(mesh.positions, mesh.faces);
  const SeedCells cells = NearestSeeds(surface, vertices);  // each its own, but for the unreferenced
  samples.graph = SeedGraph(surface, cells, std::ssize(vertices));
  samples.one_ring = RingOf(samples.graph, samples.points, max_ring);
  TakeCells(mesh.positions, cells, mesh.vertex_count(), samples);
  return samples;
}

}  // namespace stance
