#include "core/transfer/pipeline.h"

#include <fmt/format.h>

#include <cmath>

#include "core/base/stopwatch.h"
#include "core/base/threads.h"
#include "core/mesh/weld.h"
#include "core/network/pose_model.h"
#include "core/network/skeletal_model.h"
#include "core/transfer/bone_rotation_solver.h"
#include "core/transfer/diffusion_smoother.h"
#include "core/transfer/learned_rotation_solver.h"
#include "core/transfer/linear_blend_skinning.h"
#include "core/transfer/pose_rigger.h"
#include "core/transfer/screened_weights.h"
#include "core/transfer/skeletal_rigger.h"
#include "core/transfer/up_axis.h"

namespace stance {
namespace {

absl::Status Prefixed(const std::string& field, const absl::Status& status) {
  return absl::Status(status.code(), fmt::format("{}: {}", field, std::string(status.message())));
}

absl::Status CheckOptions(const TransferOptions& options, Method method) {
  if (options.method != method) {
    return absl::InvalidArgumentError(fmt::format("method: '{}' is not that of the model, '{}'",
                                                  MethodName(options.method), MethodName(method)));
  }
  const SmoothingOptions& smoothing = options.smoothing;
  if (smoothing.kind == SmoothingKind::kMetric && !(smoothing.length > 0 && smoothing.length <= 1)) {
    return absl::InvalidArgumentError(
        fmt::format("smoothing.length: {} is not in (0, 1], a fraction of the stature", smoothing.length));
  }
  if (smoothing.kind == SmoothingKind::kHopwise && !(smoothing.lambda > 0 && smoothing.lambda <= 10'000)) {
    return absl::InvalidArgumentError(
        fmt::format("smoothing.lambda: {} is not in (0, 10000]", smoothing.lambda));
  }
  if (options.max_influences < 0 || options.max_influences > kHumanJoints) {
    return absl::InvalidArgumentError(
        fmt::format("max_influences: {} is not in 0..{}", options.max_influences, kHumanJoints));
  }
  return absl::OkStatus();
}

// One mesh on its way through a batch: checked, welded, turned y up.
struct Input {
  TriangleMesh mesh;  // welded, y up
  std::vector<int32_t> welded_row;
  std::vector<std::string> warnings;
  Rig rig;  // of the welded mesh, y up
};

absl::StatusOr<Input> Prepare(const TriangleMesh& mesh, UpAxis up, const MeshLimits& limits) {
  STANCE_ASSIGN_OR_RETURN(const MeshReport report, CheckMesh(mesh, limits));
  WeldedMesh welded = WeldVertices(mesh);
  Input input{std::move(welded.mesh), std::move(welded.welded_row), report.warnings, {}};
  input.mesh.positions *= ToYUp(up).transpose();
  return input;
}

RowMatrix Unweld(const RowMatrix& rows, const std::vector<int32_t>& welded_row) {
  RowMatrix out(static_cast<int64_t>(welded_row.size()), rows.cols());
  for (size_t v = 0; v < welded_row.size(); ++v) out.row(static_cast<int64_t>(v)) = rows.row(welded_row[v]);
  return out;
}

std::unique_ptr<WeightSmoother> SmootherOf(const TransferOptions& options) {
  if (options.method == Method::kStance) return std::make_unique<ScreenedSmoother>();
  return MakeSmoother(options.smoothing);
}

std::unique_ptr<PoseSolver> SolverOf(const TransferOptions& options) {
  if (options.method == Method::kStance) return std::make_unique<LearnedRotationSolver>();
  return std::make_unique<BoneRotationSolver>(options.twist);
}

// Rotations that are global in a frame, in the frame that `turn` turns into it.
std::vector<Rotation> TurnedBack(const std::vector<Rotation>& rotations, const Eigen::Matrix3f& turn) {
  std::vector<Rotation> back;
  for (const Rotation& rotation : rotations) back.emplace_back(turn.transpose() * rotation);
  return back;
}

// The rig in the caller's frame, without weights.
Rig SkeletonOf(const Input& input, UpAxis up) {
  Rig rig;
  rig.joints = input.rig.joints * ToYUp(up);
  rig.rotations = TurnedBack(input.rig.rotations, ToYUp(up));
  rig.confidence = input.rig.confidence;
  return rig;
}

// The rig in the caller's frame, smooth, with a row for each of the file's vertices.
absl::StatusOr<Rig> FinishRig(const Input& input, UpAxis up, const TransferOptions& options) {
  STANCE_ASSIGN_OR_RETURN(RowMatrix weights, SmootherOf(options)->Smooth(input.mesh, input.rig));
  LimitInfluences(weights, options.max_influences);
  Rig rig = SkeletonOf(input, up);
  rig.weights = Unweld(weights, input.welded_row);
  return rig;
}

absl::Status CheckRig(const Rig& rig) {
  if (!rig.joints.allFinite()) return absl::InternalError("the network's joints are not finite");
  for (const Rotation& rotation : rig.rotations) {
    if (!rotation.allFinite()) return absl::InternalError("the network's rotations are not finite");
  }
  return absl::OkStatus();
}

class PipelineImpl : public Pipeline {
 public:
  PipelineImpl(std::unique_ptr<SkeletalModel> model, const PipelineOptions& options)
      : PipelineImpl(Method::kSkeletal, *model, options,
                     std::make_unique<SkeletalRigger>(*model, options.threads, options.full_resolution)) {
    skeletal_ = std::move(model);
  }
  PipelineImpl(std::unique_ptr<PoseModel> model, const PipelineOptions& options)
      : PipelineImpl(Method::kStance, *model, options,
                     std::make_unique<PoseRigger>(*model, options.threads)) {
    pose_ = std::move(model);
  }

  std::vector<absl::StatusOr<TransferResult>> TransferBatch(
      std::span<const TransferJob> jobs) const override {
    std::vector<MeshJob> meshes;
    for (const TransferJob& job : jobs) {
      meshes.push_back({job.source, job.options.source_up, &job.options, "source"});
      meshes.push_back({job.reference, job.options.reference_up, &job.options, "reference"});
    }
    Batch batch = RigAll(meshes);
    std::vector<absl::StatusOr<TransferResult>> results(jobs.size(), absl::InternalError("not run"));
    ForEach(jobs.size(), [&](int64_t i) {
      auto &source = batch.inputs[2 * i], &reference = batch.inputs[2 * i + 1];
      if (!source.ok() || !reference.ok()) {
        results[i] = source.ok() ? reference.status() : source.status();
        return;
      }
      results[i] = TransferOne(jobs[i], *source, *reference, batch.seconds);
    });
    return results;
  }

  std::vector<absl::StatusOr<RigResult>> RigBatch(std::span<const RigJob> jobs) const override {
    std::vector<MeshJob> meshes;
    for (const RigJob& job : jobs) meshes.push_back({job.mesh, job.options.source_up, &job.options, "mesh"});
    Batch batch = RigAll(meshes);
    std::vector<absl::StatusOr<RigResult>> results(jobs.size(), absl::InternalError("not run"));
    ForEach(jobs.size(), [&](int64_t i) {
      if (!batch.inputs[i].ok()) {
        results[i] = batch.inputs[i].status();
        return;
      }
      Stopwatch watch;
      RigResult result;
      result.seconds = batch.seconds;
      auto rig = FinishRig(*batch.inputs[i], jobs[i].options.source_up, jobs[i].options);
      if (!rig.ok()) {
        results[i] = rig.status();
        return;
      }
      result.rig = *std::move(rig);
      result.warnings = std::move(batch.inputs[i]->warnings);
      result.seconds.weights = watch.Lap();
      result.seconds.total += result.seconds.weights;
      results[i] = std::move(result);
    });
    return results;
  }

  const std::vector<ModelInfo>& models() const override { return models_; }
  const Skeleton& skeleton() const override { return rigger_->skeleton(); }

 private:
  template <typename Model>
  PipelineImpl(Method method, const Model& model, const PipelineOptions& options,
               std::unique_ptr<Rigger> rigger)
      : options_(options), rigger_(std::move(rigger)) {
    const ModelManifest& manifest = model.manifest();
    models_.push_back(
        {manifest.name, manifest.version, method, kHumanJoints, model.parameter_count(), manifest.samples});
  }

  struct MeshJob {
    const TriangleMesh* mesh;
    UpAxis up;
    const TransferOptions* options;
    std::string field;
  };
  struct Batch {
    std::vector<absl::StatusOr<Input>> inputs;
    PhaseSeconds seconds;  // one request's share of what the whole batch took; total is their sum
  };

  void ForEach(size_t count, const std::function<void(int64_t)>& body) const {
    ParallelFor(static_cast<int64_t>(count), options_.threads, 1, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) body(i);
    });
  }

  // Checks every mesh, and rigs the good ones in one pass through the networks.
  Batch RigAll(const std::vector<MeshJob>& jobs) const {
    Stopwatch watch;
    Batch batch;
    batch.inputs.assign(jobs.size(), absl::InternalError("not run"));
    ForEach(jobs.size(), [&](int64_t i) {
      const MeshJob& job = jobs[i];
      if (const absl::Status options = CheckOptions(*job.options, models_[0].method); !options.ok()) {
        batch.inputs[i] = Prefixed("options", options);
        return;
      }
      batch.inputs[i] = Prepare(*job.mesh, job.up, job.options->limits);
      if (!batch.inputs[i].ok()) batch.inputs[i] = Prefixed(job.field, batch.inputs[i].status());
    });
    batch.seconds.check = watch.Lap();
    std::vector<const TriangleMesh*> meshes;
    std::vector<size_t> rows;
    for (size_t i = 0; i < jobs.size(); ++i) {
      if (!batch.inputs[i].ok()) continue;
      meshes.push_back(&batch.inputs[i]->mesh);
      rows.push_back(i);
    }
    auto rigs = rigger_->RigMeshes(meshes, batch.seconds);
    for (size_t i = 0; i < rows.size(); ++i) {
      auto& input = batch.inputs[rows[i]];
      if (!rigs.ok()) {
        input = rigs.status();
      } else if (const absl::Status fit = CheckRig((*rigs)[i]); !fit.ok()) {
        input = Prefixed(jobs[rows[i]].field, fit);
      } else {
        input->rig = std::move((*rigs)[i]);
      }
    }
    const double share = 1.0 / static_cast<double>(std::max<size_t>(1, jobs.size()));
    const double per_request = jobs.empty() || jobs[0].field == "mesh" ? share : 2 * share;
    for (double* phase : {&batch.seconds.check, &batch.seconds.resample, &batch.seconds.network}) {
      *phase *= per_request;
      batch.seconds.total += *phase;
    }
    return batch;
  }

  absl::StatusOr<TransferResult> TransferOne(const TransferJob& job, const Input& source,
                                             const Input& reference, const PhaseSeconds& shared) const {
    const TransferOptions& options = job.options;
    Stopwatch watch;
    TransferResult result;
    result.seconds = shared;
    const std::vector<Rotation> rotations =
        SolverOf(options)->Solve(skeleton(), source.mesh, source.rig, reference.mesh, reference.rig);
    const std::vector<AffineTransform> y_up = PoseTransforms(skeleton(), source.rig.joints, rotations);
    const Eigen::Matrix3f turn = ToYUp(options.source_up);
    for (const AffineTransform& transform : y_up) {
      result.transforms.push_back(
          {turn.transpose() * transform.linear * turn, turn.transpose() * transform.translation});
    }
    result.seconds.pose = watch.Lap();

    STANCE_ASSIGN_OR_RETURN(result.source_rig, FinishRig(source, options.source_up, options));
    if (options.reference_weights) {
      STANCE_ASSIGN_OR_RETURN(result.reference_rig, FinishRig(reference, options.reference_up, options));
    } else {
      result.reference_rig = SkeletonOf(reference, options.reference_up);
    }
    result.seconds.weights = watch.Lap();

    result.target = *job.source;
    DropBrokenAttributes(result.target);
    result.target.positions =
        LinearBlendSkinning().Deform(job.source->positions, result.source_rig.weights, result.transforms);
    if (result.target.normals.rows() == job.source->vertex_count()) {
      result.target.normals =
          DeformNormals(job.source->normals, result.source_rig.weights, result.transforms);
    }
    if (!result.target.positions.allFinite()) return absl::InternalError("the deformed mesh is not finite");
    result.target_joints.resize(skeleton().joint_count(), 3);
    for (int j = 0; j < skeleton().joint_count(); ++j) {
      result.target_joints.row(j) =
          result.transforms[j].Apply(result.source_rig.joints.row(j).transpose()).transpose();
    }
    for (const auto& [name, warnings] :
         {std::pair{"source", &source.warnings}, std::pair{"reference", &reference.warnings}}) {
      for (const std::string& warning : *warnings)
        result.warnings.push_back(fmt::format("{}: {}", name, warning));
    }
    result.seconds.deform = watch.Lap();
    result.seconds.total += result.seconds.pose + result.seconds.weights + result.seconds.deform;
    return result;
  }

  const PipelineOptions options_;
  // The one that rigger_ refers to.
  std::unique_ptr<SkeletalModel> skeletal_;
  std::unique_ptr<PoseModel> pose_;
  const std::unique_ptr<Rigger> rigger_;
  std::vector<ModelInfo> models_;
};

// A tetrahedron the size of a body: any mesh warms the networks.
TriangleMesh WarmUpMesh() {
  TriangleMesh mesh;
  mesh.positions.resize(4, 3);
  mesh.positions << 0, 0, 0, 1, 0, 0, 0, 1.7f, 0, 0, 0, 1;
  mesh.faces.resize(4, 3);
  mesh.faces << 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2;
  return mesh;
}

}  // namespace

std::string MethodName(Method method) {
  switch (method) {
    case Method::kSkeletal:
      return kSkeletalMethod;
    case Method::kStance:
      return kStanceMethod;
  }
  return "";
}

absl::StatusOr<Method> MethodFromName(const std::string& name) {
  for (const Method method : {Method::kSkeletal, Method::kStance}) {
    if (name == MethodName(method)) return method;
  }
  return absl::InvalidArgumentError(
      fmt::format("method '{}' is unknown; known: {}, {}", name, kSkeletalMethod, kStanceMethod));
}

absl::StatusOr<std::unique_ptr<Pipeline>> Pipeline::Load(const std::filesystem::path& model_dir,
                                                         const PipelineOptions& options) {
  STANCE_ASSIGN_OR_RETURN(const ModelManifest manifest, ReadManifest(model_dir));
  if (manifest.method == kStanceMethod) {
    if (options.full_resolution) {
      return absl::InvalidArgumentError(
          fmt::format("full_resolution: the method '{}' has none", kStanceMethod));
    }
    STANCE_ASSIGN_OR_RETURN(std::unique_ptr<PoseModel> model, PoseModel::Load(model_dir));
    return std::make_unique<PipelineImpl>(std::move(model), options);
  }
  STANCE_ASSIGN_OR_RETURN(std::unique_ptr<SkeletalModel> model, SkeletalModel::Load(model_dir));
  return std::make_unique<PipelineImpl>(std::move(model), options);
}

absl::Status Pipeline::WarmUp() const {
  const TriangleMesh mesh = WarmUpMesh();
  TransferOptions options;
  options.method = models()[0].method;
  return Transfer(mesh, mesh, options).status();
}

absl::StatusOr<TransferResult> Pipeline::Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                                  const TransferOptions& options) const {
  const TransferJob job{&source, &reference, options};
  return std::move(TransferBatch({&job, 1})[0]);
}

absl::StatusOr<RigResult> Pipeline::RigMesh(const TriangleMesh& mesh, const TransferOptions& options) const {
  const RigJob job{&mesh, options};
  return std::move(RigBatch({&job, 1})[0]);
}

}  // namespace stance
