// Times of the networks' neighbourhoods along the surface, and of the alternatives to them. On two threads;
// the CPU column is the sum over them.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <nanoflann.hpp>
#include <vector>

#include "core/base/threads.h"
#include "core/mesh/farthest_point.h"
#include "core/mesh/geodesic_neighbors.h"
#include "core/mesh/resample.h"
#include "core/network/pyramid_input.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

constexpr int kMaxRing = 12;

// The same tube of some 7,000 vertices or of some 100,000, as `state.range(1)` says in thousands; it touches
// itself, as limbs do.
const TriangleMesh& MeshOf(const benchmark::State& state) {
  static const TriangleMesh coarse = testing::Coil(0.001f, 0.05f, 0.3f, 24, 145);
  static const TriangleMesh fine = testing::Coil(0.001f, 0.05f, 0.3f, 90, 555);
  return state.range(1) == 7 ? coarse : fine;
}

int Threads() { return std::min(2, CpuQuota()); }

SurfaceSamples SamplesOf(const benchmark::State& state) {
  return ResampleSurface(MeshOf(state), {state.range(0), kMaxRing});
}

NeighborTable NearOf(const SurfaceSamples& samples) {
  const int64_t rows = samples.points.rows();
  return GeodesicNeighbors(samples.graph, samples.points, 0, rows, rows, kPyramidNeighbors, Threads());
}

// Over the graph of the samples, which resampling leaves behind.
void Geodesic(benchmark::State& state) {
  const SurfaceSamples samples = SamplesOf(state);
  for (auto _ : state) benchmark::DoNotOptimize(NearOf(samples));
}

// The same with the resampling: from the mesh to the neighbourhoods.
void GeodesicFromMesh(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(NearOf(SamplesOf(state)));
}

// Those of every level.
void Pyramid(benchmark::State& state) {
  const SurfaceSamples samples = SamplesOf(state);
  for (auto _ : state) benchmark::DoNotOptimize(MakePyramidInput(samples, Threads()));
}

// Exact along the edges: Dijkstra's search over the mesh's vertices from each sample until it has met its
// neighbours. The vertices are renumbered, samples first.
void VertexDijkstra(benchmark::State& state) {
  const TriangleMesh& mesh = MeshOf(state);
  const std::vector<int32_t> seeds = FarthestPoints(mesh.positions, state.range(0));
  std::vector<int32_t> row(mesh.vertex_count(), -1);
  int32_t next = 0;
  for (const int32_t seed : seeds) row[seed] = next++;
  for (int32_t& r : row) {
    if (r < 0) r = next++;
  }
  Points points(mesh.vertex_count(), 3);
  for (int64_t v = 0; v < points.rows(); ++v) points.row(row[v]) = mesh.positions.row(v);
  const SurfaceGraph graph =
      BuildSurfaceGraph(points, mesh.faces.unaryExpr([&](int32_t v) { return row[v]; }));
  const int64_t targets = std::ssize(seeds);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        GeodesicNeighbors(graph, points, 0, targets, targets, kPyramidNeighbors, Threads()));
  }
}

struct SamplePoints {
  const Points& points;
  size_t kdtree_get_point_count() const { return points.rows(); }
  float kdtree_get_pt(size_t row, size_t axis) const {
    return points(static_cast<int64_t>(row), static_cast<int64_t>(axis));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

// The nearest in space, which go across from limb to limb: a k-d tree over the samples.
void Euclidean(benchmark::State& state) {
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, SamplePoints>,
                                                   SamplePoints, 3, int32_t>;
  const SurfaceSamples samples = SamplesOf(state);
  for (auto _ : state) {
    const SamplePoints adaptor{samples.points};
    const Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
    NeighborTable near(samples.points.rows(), kPyramidNeighbors);
    ParallelFor(near.rows(), Threads(), 64, [&](int64_t begin, int64_t end) {
      float distance[kPyramidNeighbors];
      for (int64_t s = begin; s < end; ++s) {
        tree.knnSearch(samples.points.row(s).data(), kPyramidNeighbors, near.row(s).data(), distance);
      }
    });
    benchmark::DoNotOptimize(near.data());
  }
}

void Register(const char* name, void (*function)(benchmark::State&)) {
  benchmark::RegisterBenchmark(name, function)
      ->ArgNames({"samples", "kilovertices"})
      ->ArgsProduct({{1024, 2048}, {7, 100}})
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

}  // namespace
}  // namespace stance

int main(int argc, char** argv) {
  stance::Register("Neighbors/geodesic", stance::Geodesic);
  stance::Register("Neighbors/geodesic_from_mesh", stance::GeodesicFromMesh);
  stance::Register("Neighbors/pyramid", stance::Pyramid);
  stance::Register("Neighbors/vertex_dijkstra", stance::VertexDijkstra);
  stance::Register("Neighbors/euclidean", stance::Euclidean);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
