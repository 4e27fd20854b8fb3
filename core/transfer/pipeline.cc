#include "core/transfer/pipeline.h"

#include <fmt/format.h>

#include <cmath>

#include "core/base/stopwatch.h"
#include "core/base/threads.h"
#include "core/mesh/weld.h"
#include "core/network/skeletal_model.h"
#include "core/transfer/bone_rotation_solver.h"
#include "core/transfer/diffusion_smoother.h"
#include "core/transfer/linear_blend_skinning.h"
#include "core/transfer/skeletal_rigger.h"
#include "core/transfer/up_axis.h"

namespace stance {
namespace {

absl::Status Prefixed(const std::string& field, const absl::Status& status) {
  return absl::Status(status.code(), fmt::format("{}: {}", field, std::string(status.message())));
}

absl::Status CheckOptions(const TransferOptions& options) {
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

// The rig in the caller's frame, smooth, with a row for each of the file's vertices.
absl::StatusOr<Rig> FinishRig(const Input& input, UpAxis up, const TransferOptions& options) {
  STANCE_ASSIGN_OR_RETURN(RowMatrix weights,
                          MakeSmoother(options.smoothing)->Smooth(input.mesh, input.rig.weights));
  LimitInfluences(weights, options.max_influences);
  return Rig{input.rig.joints * ToYUp(up), Unweld(weights, input.welded_row)};
}

absl::Status CheckRig(const Rig& rig) {
  if (rig.joints.allFinite()) return absl::OkStatus();
  return absl::InternalError("the network's joints are not finite");
}

class PipelineImpl : public Pipeline {
 public:
  PipelineImpl(std::unique_ptr<SkeletalModel> model, const PipelineOptions& options)
      : options_(options),
        model_(std::move(model)),
        rigger_(*model_, options.threads, options.full_resolution) {
    const ModelManifest& manifest = model_->manifest();
    models_.push_back({manifest.name, manifest.version, Method::kSkeletal, kHumanJoints,
                       model_->parameter_count(), manifest.samples});
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
  const Skeleton& skeleton() const override { return rigger_.skeleton(); }

 private:
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
      if (const absl::Status options = CheckOptions(*job.options); !options.ok()) {
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
    auto rigs = rigger_.RigMeshes(meshes, batch.seconds);
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
        BoneRotationSolver(options.twist)
            .Solve(skeleton(), source.mesh, source.rig, reference.mesh, reference.rig);
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
      result.reference_rig.joints = reference.rig.joints * ToYUp(options.reference_up);
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
  const std::unique_ptr<SkeletalModel> model_;
  const SkeletalRigger rigger_;
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
      return "skeletal";
  }
  return "";
}

absl::StatusOr<Method> MethodFromName(const std::string& name) {
  if (name == "skeletal") return Method::kSkeletal;
  return absl::InvalidArgumentError(fmt::format("method '{}' is unknown; known: skeletal", name));
}

absl::StatusOr<std::unique_ptr<Pipeline>> Pipeline::Load(const std::filesystem::path& model_dir,
                                                         const PipelineOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::unique_ptr<SkeletalModel> model, SkeletalModel::Load(model_dir));
  return std::make_unique<PipelineImpl>(std::move(model), options);
}

absl::Status Pipeline::WarmUp() const {
  const TriangleMesh mesh = WarmUpMesh();
  return Transfer(mesh, mesh).status();
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
