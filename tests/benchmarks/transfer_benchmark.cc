// Times of one SMPL-sized pair (6,890 vertices each), phase by phase, and of the alternatives that the papers
// use.

#include <ATen/Parallel.h>
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "core/base/allocator.h"
#include "core/base/check.h"
#include "core/base/threads.h"
#include "core/mesh/laplacian.h"
#include "core/mesh/mesh_io.h"
#include "core/mesh/resample.h"
#include "core/network/knn.h"
#include "core/network/skeletal_networks.h"
#include "core/transfer/diffusion_smoother.h"
#include "core/transfer/pipeline.h"
#include "core/transfer/rig_cache.h"

namespace stance {
namespace {

const TriangleMesh& Sample(const std::string& name) {
  static const TriangleMesh source = *ReadMesh(std::filesystem::path(STANCE_SAMPLE_DIR) / "source.glb");
  static const TriangleMesh reference = *ReadMesh(std::filesystem::path(STANCE_SAMPLE_DIR) / "reference.glb");
  return name == "source" ? source : reference;
}

// The whole pair by that model's method, all in; counters give the phases in milliseconds. With a cache,
// both meshes are known from the second time on.
void Transfer(benchmark::State& state, const std::string& model, const PipelineOptions& options) {
  const auto pipeline = Pipeline::Load(std::filesystem::path(STANCE_MODELS_DIR) / model, options);
  STANCE_CHECK(pipeline.ok());
  if (options.rig_cache != nullptr) {
    STANCE_CHECK((*pipeline)->Transfer(Sample("source"), Sample("reference")).ok());
  }
  PhaseSeconds sum;
  for (auto _ : state) {
    const auto result = (*pipeline)->Transfer(Sample("source"), Sample("reference"));
    STANCE_CHECK(result.ok());
    const PhaseSeconds& s = result->seconds;
    sum.check += s.check;
    sum.resample += s.resample;
    sum.network += s.network;
    sum.pose += s.pose;
    sum.weights += s.weights;
    sum.deform += s.deform;
  }
  const auto counter = [&](const char* name, double seconds) {
    state.counters[name] = benchmark::Counter(1e3 * seconds, benchmark::Counter::kAvgIterations);
  };
  counter("check_ms", sum.check);
  counter("resample_ms", sum.resample);
  counter("network_ms", sum.network);
  counter("pose_ms", sum.pose);
  counter("weights_ms", sum.weights);
  counter("deform_ms", sum.deform);
}

PointBatch FullResolutionBatch() {
  static const SurfaceSamples samples = VertexSamples(Sample("source"));
  static const NetworkInput input{samples.points, samples.one_ring};
  const NetworkInput* inputs[] = {&input};
  PointBatch batch = StackInputs(inputs);
  AddSpatialNeighbors(batch);
  return batch;
}

// f_C over 6,890 vertices on one thread: the exact decomposition against the edge-by-edge formulation.
void Confidence(benchmark::State& state, bool plain) {
  torch::InferenceMode inference;
  at::set_num_threads(1);
  WeightNetwork network;
  network->eval();
  const PointBatch batch = FullResolutionBatch();
  for (auto _ : state) {
    benchmark::DoNotOptimize(plain ? network->ForwardPlain(batch) : network(batch));
  }
}

// A layer's features over a surface fill few dimensions: random maps of the positions, as wide as the
// layer's.
torch::Tensor SurfaceFeatures(int64_t rows, int64_t channels) {
  torch::manual_seed(1);
  const PointBatch batch = FullResolutionBatch();
  auto x = batch.points;
  while (x.size(0) < rows) x = torch::cat({x, x + 1e-3 * torch::randn_like(x)});
  x = x.slice(0, 0, rows).contiguous();
  return channels == 3 ? x : torch::tanh(torch::mm(x, torch::randn({3, channels})) * 3);
}

void Knn(benchmark::State& state, bool torch) {
  at::set_num_threads(1);
  const auto x = SurfaceFeatures(state.range(1), state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(torch ? KNearestByTorch(x, kNeighbors) : KNearest(x, {0, x.size(0)}));
  }
}

RowMatrix RigidByHeight(const TriangleMesh& mesh) {
  RowMatrix w = RowMatrix::Zero(mesh.vertex_count(), kHumanJoints);
  const float low = mesh.positions.col(1).minCoeff(), high = mesh.positions.col(1).maxCoeff();
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    const auto joint = static_cast<int>((mesh.positions(v, 1) - low) / (high - low) * (kHumanJoints - 1));
    w(v, joint) = 1;
  }
  return w;
}

void SparseWeights(benchmark::State& state) {
  Rig rig;
  rig.weights = RigidByHeight(Sample("source"));
  for (auto _ : state) benchmark::DoNotOptimize(DiffusionSmoother({}).Smooth(Sample("source"), rig));
}

// Paper A: "we use a dense matrix in our experiments". LibTorch's LAPACK, a solve in place of the inverse.
void DenseWeights(benchmark::State& state) {
  const TriangleMesh& mesh = Sample("source");
  at::set_num_threads(CpuQuota());
  const SparseMatrix laplacian = CotangentLaplacian(mesh.positions, mesh.faces);
  const Eigen::VectorXd inverse = laplacian.diagonal().cwiseMax(1e-12).cwiseInverse();
  Eigen::Matrix<float, -1, -1, Eigen::RowMajor> dense =
      (20.0 * (inverse.asDiagonal() * Eigen::MatrixXd(laplacian))).cast<float>();
  dense.diagonal().array() += 1;
  const RowMatrix w = RigidByHeight(mesh);
  const auto a = torch::from_blob(dense.data(), {dense.rows(), dense.cols()});
  const auto b = torch::from_blob(const_cast<float*>(w.data()), {w.rows(), w.cols()});
  for (auto _ : state) benchmark::DoNotOptimize(at::linalg_solve(a, b));
}

PipelineOptions Cold() { return {.threads = CpuQuota()}; }
PipelineOptions Warm() {
  return {.threads = CpuQuota(), .rig_cache = std::make_shared<RigCache>(int64_t{256} << 20)};
}
PipelineOptions FullResolution() { return {.threads = CpuQuota(), .full_resolution = true}; }

BENCHMARK_CAPTURE(Transfer, sampled, "skeletal-human24", Cold())
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(Transfer, sampled_warm, "skeletal-human24", Warm())
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(Transfer, full_resolution, "skeletal-human24", FullResolution())
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(Confidence, decomposed, false)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(Confidence, plain, true)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(Knn, index, false)
    ->ArgsProduct({{3, 64, 128}, {512, 1024, 6890, 27556}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(Knn, torch, true)
    ->ArgsProduct({{3, 64, 128}, {512, 1024, 6890, 27556}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(SparseWeights)->Name("Weights/sparse")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(DenseWeights)->Name("Weights/dense")->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);

constexpr char kStanceModel[] = "stance-human24";

// Only where the model is: without it there is nothing to measure.
void RegisterStance() {
  if (!std::filesystem::exists(std::filesystem::path(STANCE_MODELS_DIR) / kStanceModel / "manifest.json"))
    return;
  for (const auto& [name, options] :
       {std::pair{"Transfer/stance", Cold()}, std::pair{"Transfer/stance_warm", Warm()}}) {
    benchmark::RegisterBenchmark(
        name, [options = options](benchmark::State& state) { Transfer(state, kStanceModel, options); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
}

}  // namespace
}  // namespace stance

int main(int argc, char** argv) {
  stance::KeepFreedMemory();  // as the server does
  stance::RegisterStance();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
