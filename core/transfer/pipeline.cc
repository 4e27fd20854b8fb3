#include "core/transfer/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/stopwatch.h"
#include "core/base/threads.h"
#include "core/mesh/measure.h"
#include "core/mesh/weld.h"
#include "core/transfer/confidence.h"
#include "core/transfer/diffusion_smoother.h"
#include "core/transfer/linear_blend_skinning.h"
#include "core/transfer/loaded_method.h"
#include "core/transfer/placement.h"
#include "core/transfer/rig_cache.h"
#include "core/transfer/rotation_fit.h"
#include "core/transfer/up_axis.h"

namespace stance {
namespace {

absl::Status Prefixed(const std::string& field, const absl::Status& status) {
  return absl::Status(status.code(), fmt::format("{}: {}", field, std::string(status.message())));
}

// One mesh on its way through a batch: checked, welded, turned y up.
struct Input {
  TriangleMesh mesh;  // welded, y up
  std::vector<int32_t> welded_row;
  std::vector<std::string> warnings;
  CachedRig rig{};            // of the welded mesh, y up
  RigCache* cache = nullptr;  // where the rig is kept; may be null
  PhaseSeconds seconds{};     // its share of what its batch took; total is the sum
};

absl::StatusOr<Input> Prepare(const TriangleMesh& mesh, UpAxis up, const MeshLimits& limits) {
  STANCE_ASSIGN_OR_RETURN(const MeshReport report, CheckMesh(mesh, limits));
  WeldedMesh welded = WeldVertices(mesh);
  Input input{std::move(welded.mesh), std::move(welded.welded_row), report.warnings};
  input.mesh.positions *= ToYUp(up).transpose();
  return input;
}

absl::Status CheckWanted(const GivenUp& given_up) {
  if (given_up && given_up()) return absl::CancelledError("the caller gave the job up");
  return absl::OkStatus();
}

template <typename Matrix>
Matrix Unweld(const Matrix& rows, const std::vector<int32_t>& welded_row) {
  Matrix out(static_cast<int64_t>(welded_row.size()), rows.cols());
  for (size_t v = 0; v < welded_row.size(); ++v) out.row(static_cast<int64_t>(v)) = rows.row(welded_row[v]);
  return out;
}

// A row of those that share a welded vertex for each of `count` of them.
RowMatrix Weld(const RowMatrix& rows, const std::vector<int32_t>& welded_row, int64_t count) {
  RowMatrix out = RowMatrix::Zero(count, rows.cols());
  for (size_t v = 0; v < welded_row.size(); ++v) out.row(welded_row[v]) = rows.row(static_cast<int64_t>(v));
  return out;
}

// Rotations that are global in a frame, in the frame that `turn` turns into it.
std::vector<Rotation> TurnedBack(const std::vector<Rotation>& rotations, const Eigen::Matrix3f& turn) {
  std::vector<Rotation> back;
  for (const Rotation& rotation : rotations) back.emplace_back(turn.transpose() * rotation);
  return back;
}

// The rig in the caller's frame, without weights.
Rig SkeletonOf(const Input& input, UpAxis up) {
  const Rig& own = *input.rig.rig;
  Rig rig;
  rig.joints = own.joints * ToYUp(up);
  rig.rotations = TurnedBack(own.rotations, ToYUp(up));
  rig.confidence = own.confidence;
  return rig;
}

// (V, J) of the welded mesh, from the cache if they are there.
absl::StatusOr<RowMatrix> SmoothWeights(const LoadedMethod& method, const Input& input,
                                        const TransferOptions& options) {
  const CachedRig& known = input.rig;
  if (known.smooth != nullptr && known.smoothing == options.smoothing) return *known.smooth;
  STANCE_ASSIGN_OR_RETURN(RowMatrix weights,
                          method.MakeWeightSmoother(options)->Smooth(input.mesh, *known.rig));
  if (input.cache != nullptr) {
    input.cache->Put(method.id(), input.mesh,
                     {known.rig, std::make_shared<const RowMatrix>(weights), options.smoothing});
  }
  return weights;
}

// The rig in the caller's frame, smooth, with a row for each of the file's vertices.
absl::StatusOr<Rig> FinishRig(const LoadedMethod& method, const Input& input, UpAxis up,
                              const TransferOptions& options) {
  STANCE_ASSIGN_OR_RETURN(RowMatrix weights, SmoothWeights(method, input, options));
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

PhaseSeconds Sum(const PhaseSeconds& a, const PhaseSeconds& b) {
  return {a.check + b.check,     a.resample + b.resample, a.network + b.network, a.pose + b.pose,
          a.weights + b.weights, a.deform + b.deform,     a.total + b.total};
}

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

struct RiggedSource {
  uint64_t method = 0;  // the id of the one that rigged it
  Input input;          // without seconds
  Rig rig;              // in the caller's frame, smooth, with a row for each of the file's vertices
};

namespace {

class PipelineImpl : public Pipeline {
 public:
  // REQUIRES: at least one method, none twice.
  PipelineImpl(std::vector<std::unique_ptr<LoadedMethod>> methods, const PipelineOptions& options)
      : options_(options), methods_(std::move(methods)) {
    for (const auto& method : methods_) models_.push_back(method->info());
  }
  ~PipelineImpl() override {
    if (options_.rig_cache == nullptr) return;
    for (const auto& method : methods_) options_.rig_cache->Drop(method->id());
  }

  std::vector<absl::StatusOr<TransferResult>> TransferBatch(
      std::span<const TransferJob> jobs) const override {
    return TransferAll(jobs, options_.rig_cache.get());
  }

  std::vector<absl::StatusOr<RigResult>> RigBatch(std::span<const RigJob> jobs) const override {
    std::vector<MeshJob> meshes;
    for (const RigJob& job : jobs) {
      meshes.push_back({job.mesh, job.options.source_up, &job.options, &job.given_up, "mesh"});
    }
    const std::vector<absl::StatusOr<Input>> inputs = RigAll(meshes, options_.rig_cache.get());
    std::vector<absl::StatusOr<RigResult>> results(jobs.size(), absl::InternalError("not run"));
    ForEach(jobs.size(), [&](int64_t i) {
      if (!inputs[i].ok()) {
        results[i] = inputs[i].status();
        return;
      }
      results[i] = RigOne(jobs[i], *inputs[i]);
    });
    return results;
  }

  std::vector<absl::StatusOr<RigSourceResult>> RigSources(std::span<const RigJob> jobs) const override {
    std::vector<MeshJob> meshes;
    for (const RigJob& job : jobs) {
      meshes.push_back({job.mesh, job.options.source_up, &job.options, &job.given_up, "source"});
    }
    std::vector<absl::StatusOr<Input>> inputs = RigAll(meshes, options_.rig_cache.get());
    std::vector<absl::StatusOr<RigSourceResult>> results(jobs.size(), absl::InternalError("not run"));
    ForEach(jobs.size(), [&](int64_t i) {
      if (!inputs[i].ok()) {
        results[i] = inputs[i].status();
        return;
      }
      results[i] = RigSource(jobs[i], *std::move(inputs[i]));
    });
    return results;
  }

  absl::Status WarmUp() const override {
    const TriangleMesh mesh = WarmUpMesh();
    for (const ModelInfo& model : models_) {
      const TransferJob job{&mesh, &mesh, {.method = model.method}};
      STANCE_RETURN_IF_ERROR(TransferAll({&job, 1}, nullptr)[0].status());
    }
    return absl::OkStatus();
  }

  const std::vector<ModelInfo>& models() const override { return models_; }
  const Skeleton& skeleton() const override { return methods_.front()->rigger().skeleton(); }

 private:
  struct MeshJob {
    const TriangleMesh* mesh;
    UpAxis up;
    const TransferOptions* options;
    const GivenUp* given_up;
    std::string field;
  };

  void ForEach(size_t count, const std::function<void(int64_t)>& body) const {
    ParallelFor(static_cast<int64_t>(count), options_.threads, 1, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) body(i);
    });
  }

  // The one that the options ask for; null if it has no model here.
  const LoadedMethod* FindMethod(const TransferOptions& options) const {
    if (!options.method) return methods_.front().get();
    for (const auto& method : methods_) {
      if (method->info().method == *options.method) return method.get();
    }
    return nullptr;
  }

  // What RigSources made of the job's source, if it serves here.
  const RiggedSource* RiggedBefore(const TransferJob& job) const {
    const LoadedMethod* method = FindMethod(job.options);
    const bool ours = job.rigged != nullptr && method != nullptr && job.rigged->method == method->id();
    return ours ? job.rigged.get() : nullptr;
  }

  std::vector<absl::StatusOr<TransferResult>> TransferAll(std::span<const TransferJob> jobs,
                                                          RigCache* cache) const {
    std::vector<MeshJob> meshes;
    std::vector<size_t> reference_row(jobs.size());  // of meshes; the source's, if it is there, comes before
    for (size_t i = 0; i < jobs.size(); ++i) {
      const TransferJob& job = jobs[i];
      if (RiggedBefore(job) == nullptr) {
        meshes.push_back({job.source, job.options.source_up, &job.options, &job.given_up, "source"});
      }
      reference_row[i] = meshes.size();
      meshes.push_back({job.reference, job.options.reference_up, &job.options, &job.given_up, "reference"});
    }
    const std::vector<absl::StatusOr<Input>> inputs = RigAll(meshes, cache);
    std::vector<absl::StatusOr<TransferResult>> results(jobs.size(), absl::InternalError("not run"));
    // Several jobs share the threads, one has them all.
    const int threads = jobs.size() > 1 ? 1 : options_.threads;
    ForEach(jobs.size(), [&](int64_t i) {
      const RiggedSource* rigged = RiggedBefore(jobs[i]);
      const auto& reference = inputs[reference_row[i]];
      const absl::Status source =
          rigged == nullptr ? inputs[reference_row[i] - 1].status() : absl::OkStatus();
      if (!source.ok() || !reference.ok()) {
        results[i] = source.ok() ? reference.status() : source;
        return;
      }
      const Input& input = rigged == nullptr ? *inputs[reference_row[i] - 1] : rigged->input;
      results[i] = TransferOne(jobs[i], input, *reference, rigged, threads);
    });
    return results;
  }

  absl::Status CheckJob(const TransferOptions& options) const {
    if (FindMethod(options) == nullptr) {
      std::vector<std::string> loaded;
      for (const ModelInfo& model : models_) loaded.push_back(MethodName(model.method));
      return absl::FailedPreconditionError(fmt::format("method: '{}' has no model here; loaded: {}",
                                                       MethodName(*options.method), fmt::join(loaded, ", ")));
    }
    return CheckOptions(options);
  }

  // Checks every mesh, and rigs the good ones, those of a method in one pass through its networks.
  std::vector<absl::StatusOr<Input>> RigAll(const std::vector<MeshJob>& jobs, RigCache* cache) const {
    Stopwatch watch;
    std::vector<absl::StatusOr<Input>> inputs(jobs.size(), absl::InternalError("not run"));
    ForEach(jobs.size(), [&](int64_t i) {
      const MeshJob& job = jobs[i];
      if (const absl::Status options = CheckJob(*job.options); !options.ok()) {
        inputs[i] = Prefixed("options", options);
        return;
      }
      if (const absl::Status wanted = CheckWanted(*job.given_up); !wanted.ok()) {
        inputs[i] = wanted;
        return;
      }
      inputs[i] = Prepare(*job.mesh, job.up, job.options->limits);
      if (!inputs[i].ok()) inputs[i] = Prefixed(job.field, inputs[i].status());
    });
    const double check = watch.Lap() / static_cast<double>(std::max<size_t>(1, jobs.size()));
    for (const auto& method : methods_) {
      std::vector<size_t> rows;
      for (size_t i = 0; i < jobs.size(); ++i) {
        if (!inputs[i].ok() || FindMethod(*jobs[i].options) != method.get()) continue;
        if (const absl::Status wanted = CheckWanted(*jobs[i].given_up); !wanted.ok()) {
          inputs[i] = wanted;
        } else {
          rows.push_back(i);
        }
      }
      if (!rows.empty()) RigSome(*method, jobs, rows, check, cache, inputs);
    }
    return inputs;
  }

  // Gives the inputs in `rows` what the cache knows of them and returns the rows of the others, each with
  // those of equal meshes behind it.
  static std::vector<std::vector<size_t>> FindKnown(const LoadedMethod& method,
                                                    const std::vector<size_t>& rows, RigCache& cache,
                                                    std::vector<absl::StatusOr<Input>>& inputs) {
    std::vector<std::vector<size_t>> unknown;
    for (const size_t row : rows) {
      Input& input = *inputs[row];
      const auto equal = std::find_if(unknown.begin(), unknown.end(), [&](const std::vector<size_t>& group) {
        return SameSurface(inputs[group.front()]->mesh, input.mesh);
      });
      if (equal != unknown.end()) {
        equal->push_back(row);
      } else if (auto known = cache.Find(method.id(), input.mesh)) {
        input.rig = *std::move(known);
      } else {
        unknown.push_back({row});
      }
    }
    return unknown;
  }

  // Rigs the inputs in `rows`, all of which are good, together. `check`: seconds spent on each so far.
  static void RigSome(const LoadedMethod& method, const std::vector<MeshJob>& jobs,
                      const std::vector<size_t>& rows, double check, RigCache* cache,
                      std::vector<absl::StatusOr<Input>>& inputs) {
    for (const size_t row : rows) {
      inputs[row]->cache = cache;
      inputs[row]->seconds = {.check = check, .total = check};
    }
    std::vector<std::vector<size_t>> groups;
    if (cache != nullptr) {
      groups = FindKnown(method, rows, *cache, inputs);
    } else {
      for (const size_t row : rows) groups.push_back({row});
    }
    if (groups.empty()) return;
    std::vector<const TriangleMesh*> meshes;
    for (const auto& group : groups) meshes.push_back(&inputs[group.front()]->mesh);
    PhaseSeconds seconds;
    auto rigs = method.rigger().RigMeshes(meshes, seconds);
    const double share = 1.0 / static_cast<double>(groups.size());
    seconds = {.check = check, .resample = seconds.resample * share, .network = seconds.network * share};
    seconds.total = seconds.check + seconds.resample + seconds.network;
    for (size_t i = 0; i < groups.size(); ++i) {
      const absl::Status fit = rigs.ok() ? CheckRig((*rigs)[i]) : rigs.status();
      if (!fit.ok()) {
        for (const size_t row : groups[i]) inputs[row] = rigs.ok() ? Prefixed(jobs[row].field, fit) : fit;
        continue;
      }
      const CachedRig rig{std::make_shared<const Rig>(std::move((*rigs)[i]))};
      if (cache != nullptr) cache->Put(method.id(), *meshes[i], rig);
      for (const size_t row : groups[i]) inputs[row]->rig = rig;
      inputs[groups[i].front()]->seconds = seconds;
    }
  }

  absl::StatusOr<RigResult> RigOne(const RigJob& job, const Input& input) const {
    STANCE_RETURN_IF_ERROR(CheckWanted(job.given_up));
    const LoadedMethod& method = *FindMethod(job.options);
    Stopwatch watch;
    RigResult result;
    STANCE_ASSIGN_OR_RETURN(result.rig, FinishRig(method, input, job.options.source_up, job.options));
    result.model = method.info().name;
    result.warnings = input.warnings;
    result.seconds = input.seconds;
    result.seconds.weights = watch.Lap();
    result.seconds.total += result.seconds.weights;
    return result;
  }

  absl::StatusOr<RigSourceResult> RigSource(const RigJob& job, Input input) const {
    STANCE_RETURN_IF_ERROR(CheckWanted(job.given_up));
    const LoadedMethod& method = *FindMethod(job.options);
    Stopwatch watch;
    auto rigged = std::make_shared<RiggedSource>();
    rigged->method = method.id();
    STANCE_ASSIGN_OR_RETURN(rigged->rig, FinishRig(method, input, job.options.source_up, job.options));
    RigSourceResult result;
    result.seconds = input.seconds;
    result.seconds.weights = watch.Lap();
    result.seconds.total += result.seconds.weights;
    input.seconds = {};
    rigged->input = std::move(input);
    result.rigged = std::move(rigged);
    return result;
  }

  // What gives the source the pose: global rotations, source -> target, and the vertices' places where the
  // method has a deformer of its own. Of the welded mesh, y up.
  struct Pose {
    std::vector<Rotation> rotations;
    std::optional<Points> positions{};
  };

  Pose SolvePose(const PoseSolver& solver, const Input& source, const Input& reference) const {
    return {solver.Solve(skeleton(), source.mesh, *source.rig.rig, reference.mesh, *reference.rig.rig)};
  }

  // `weights`: of the source's file. The rotations are those that the deformed vertices show.
  absl::StatusOr<Pose> DeformedPose(const PairDeformer& deformer, const Input& source, const Input& reference,
                                    const RowMatrix& weights, int threads) const {
    const TriangleMesh& mesh = source.mesh;
    const RowMatrix welded = Weld(weights, source.welded_row, mesh.vertex_count());
    STANCE_ASSIGN_OR_RETURN(
        Points moved, deformer.Deform(mesh.positions, welded, *source.rig.rig, *reference.rig.rig, threads));
    if (!moved.allFinite()) return absl::InternalError("the deformed mesh is not finite");
    const Eigen::VectorXd mass = VertexAreas(mesh.positions, mesh.faces);
    std::vector<Rotation> rotations = FitRotations(skeleton(), {mesh.positions, moved, welded, mass});
    return Pose{std::move(rotations), std::move(moved)};
  }

  // Turns the pose about the source's pelvis to where the target is to face.
  static void Face(Facing facing, const Rig& source, Pose& pose) {
    if (facing == Facing::kReference) return;
    const Rotation turn = FacingTurn(AxesOf(source), pose.rotations[kPelvis]);
    for (Rotation& rotation : pose.rotations) rotation = turn * rotation;
    if (!pose.positions) return;
    const Eigen::RowVector3f pelvis = source.joints.row(kPelvis);
    *pose.positions = ((pose.positions->rowwise() - pelvis) * turn.transpose()).rowwise() + pelvis;
  }

  // The transforms of the pose, in the source's own frame.
  std::vector<AffineTransform> TransformsOf(const Pose& pose, const Input& source, UpAxis up) const {
    std::vector<AffineTransform> transforms =
        PoseTransforms(skeleton(), source.rig.rig->joints, pose.rotations);
    const Eigen::Matrix3f to_y_up = ToYUp(up);
    for (AffineTransform& transform : transforms) {
      transform.linear = to_y_up.transpose() * transform.linear * to_y_up;
      transform.translation = to_y_up.transpose() * transform.translation;
    }
    return transforms;
  }

  // Moves the target along the up axis until it stands as low as the source.
  static void StandAsLow(const TriangleMesh& source, UpAxis source_up, TransferResult& result) {
    const Eigen::Vector3f up = ToYUp(source_up).row(1).transpose();
    const float rise = LowestHeight(source.positions, source.faces, up) -
                       LowestHeight(result.target.positions, source.faces, up);
    result.target.positions.rowwise() += rise * up.transpose();
    for (AffineTransform& transform : result.transforms) transform.translation += rise * up;
  }

  // `rigged`: where the source comes from, if it was rigged before.
  absl::StatusOr<TransferResult> TransferOne(const TransferJob& job, const Input& source,
                                             const Input& reference, const RiggedSource* rigged,
                                             int threads) const {
    STANCE_RETURN_IF_ERROR(CheckWanted(job.given_up));
    const TransferOptions& options = job.options;
    const LoadedMethod& method = *FindMethod(options);
    Stopwatch watch;
    TransferResult result;
    result.model = method.info().name;
    result.seconds = Sum(source.seconds, reference.seconds);
    Pose pose;
    if (method.deformer() == nullptr) {
      pose = SolvePose(*method.MakeSolver(options), source, reference);
      result.seconds.pose = watch.Lap();
    }
    STANCE_RETURN_IF_ERROR(CheckWanted(job.given_up));

    if (rigged != nullptr) {
      result.source_rig = rigged->rig;
    } else {
      STANCE_ASSIGN_OR_RETURN(result.source_rig, FinishRig(method, source, options.source_up, options));
    }
    if (options.reference_weights) {
      STANCE_ASSIGN_OR_RETURN(result.reference_rig,
                              FinishRig(method, reference, options.reference_up, options));
    } else {
      result.reference_rig = SkeletonOf(reference, options.reference_up);
    }
    result.confidence =
        TransferConfidence(JointShares(job.source->positions, job.source->faces, result.source_rig.weights),
                           result.source_rig.confidence, result.reference_rig.confidence);
    result.seconds.weights = watch.Lap();
    STANCE_RETURN_IF_ERROR(CheckWanted(job.given_up));

    if (const PairDeformer* deformer = method.deformer(); deformer != nullptr) {
      STANCE_ASSIGN_OR_RETURN(pose,
                              DeformedPose(*deformer, source, reference, result.source_rig.weights, threads));
    }
    Face(options.facing, *source.rig.rig, pose);
    result.transforms = TransformsOf(pose, source, options.source_up);
    result.target = *job.source;
    DropBrokenAttributes(result.target);
    result.target.positions =
        pose.positions ? Points(Unweld(*pose.positions, source.welded_row) * ToYUp(options.source_up))
                       : LinearBlendSkinning().Deform(job.source->positions, result.source_rig.weights,
                                                      result.transforms);
    if (result.target.normals.rows() == job.source->vertex_count()) {
      result.target.normals =
          DeformNormals(job.source->normals, result.source_rig.weights, result.transforms);
    }
    if (!result.target.positions.allFinite()) return absl::InternalError("the deformed mesh is not finite");
    if (options.ground == Ground::kSource) StandAsLow(*job.source, options.source_up, result);
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
  const std::vector<std::unique_ptr<LoadedMethod>> methods_;  // the default first
  std::vector<ModelInfo> models_;                             // theirs
};

}  // namespace

absl::StatusOr<std::unique_ptr<Pipeline>> Pipeline::Load(const std::vector<std::filesystem::path>& folders,
                                                         const PipelineOptions& options) {
  STANCE_ASSIGN_OR_RETURN(std::vector<std::unique_ptr<LoadedMethod>> methods, LoadMethods(folders, options));
  return std::make_unique<PipelineImpl>(std::move(methods), options);
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
