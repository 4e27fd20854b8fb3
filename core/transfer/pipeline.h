// The whole pose transfer as one call: what the server, the CLI and the evaluator share.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/parts.h"

namespace stance {

enum class Method {
  kSkeletal,  // paper A: rigid weights, Algorithm 1, diffusion, linear blend skinning
  kStance,    // our own: soft weights and rotations by one network, screened weights, linear blend skinning
};

// The method's name in commands and configuration: "skeletal".
std::string MethodName(Method method);
absl::StatusOr<Method> MethodFromName(const std::string& name);

enum class SmoothingKind {
  kMetric,   // (M + tL) W = M W0, t in m^2: independent of vertex density (the default)
  kHopwise,  // (I + lambda L_c) W = W0: paper A's operator, lambda = 20 in its experiments
  kNone,     // rigid weights, as in paper A's ablation
};

struct SmoothingOptions {
  SmoothingKind kind = SmoothingKind::kMetric;
  // kMetric: the diffusion length sqrt(t) as a fraction of the stature, in (0, 1].
  double length = 0.024;
  // kHopwise: paper A's lambda, in (0, 10000].
  double lambda = 20.0;
};

// How a bone's rotation about its own axis is chosen.
enum class Twist {
  kPaper,      // the smallest rotation between the bones' directions (paper A): the parent's twist is lost
  kInherited,  // the parent's rotation first, then the smallest one that makes the bone point right
};

// Which axis of an input points up; the computation and the answer's frame are explained in
// docs/conventions.md. The target keeps the source's own axes.
enum class UpAxis { kY, kZ, kX };

struct TransferOptions {
  Method method = Method::kSkeletal;  // must be the model's
  SmoothingOptions smoothing{};       // of kSkeletal
  Twist twist = Twist::kPaper;        // of kSkeletal
  UpAxis source_up = UpAxis::kY;
  UpAxis reference_up = UpAxis::kY;
  // Most non-zero weights per vertex in the answer and the deformation; 0 keeps all.
  int max_influences = 4;
  // Also smooth the reference's weights, which the transfer itself doesn't need.
  bool reference_weights = false;
  MeshLimits limits{};
};

// One mesh with its skeleton and smooth weights. Joints are in the mesh's own frame and unit.
struct RigResult {
  Rig rig;
  std::vector<std::string> warnings;
  PhaseSeconds seconds;
};

struct TransferResult {
  TriangleMesh target;  // the source's faces, texture coordinates and groups; new positions (and normals)
  Rig source_rig;       // smooth weights
  Rig reference_rig;    // smooth weights; no rows unless options.reference_weights
  Points target_joints;
  std::vector<AffineTransform> transforms;  // (J) source -> target, in the source's frame and unit
  std::vector<std::string> warnings;        // "source: 3 degenerate faces (first: face 17)"
  PhaseSeconds seconds;
};

struct TransferJob {
  const TriangleMesh* source = nullptr;
  const TriangleMesh* reference = nullptr;
  TransferOptions options;
};

struct RigJob {
  const TriangleMesh* mesh = nullptr;
  TransferOptions options;  // source_up, smoothing, max_influences and limits apply
};

struct PipelineOptions {
  // Threads one call may use. workers x threads should not exceed CpuQuota().
  int threads = 1;
  // Let the networks see every vertex in place of the model's number of samples (paper A's own way). Slower,
  // and worse on meshes whose vertices aren't as dense as the samples that the model was trained on.
  bool full_resolution = false;
};

struct ModelInfo {
  std::string name;     // e.g. "skeletal-human24"
  std::string version;  // from the model's manifest
  Method method = Method::kSkeletal;
  int joint_count = 0;
  int64_t parameter_count = 0;
  int64_t sample_count = 0;  // surface samples the networks see
};

// Loads once, transfers many. Thread-safe: const calls may run at the same time.
class Pipeline {
 public:
  // Loads the model in `model_dir` (models/README.md says what lies there). NOT_FOUND, INVALID_ARGUMENT or
  // DATA_LOSS, with the path, for a model that is missing, unknown or damaged.
  static absl::StatusOr<std::unique_ptr<Pipeline>> Load(const std::filesystem::path& model_dir,
                                                        const PipelineOptions& options = {});
  virtual ~Pipeline() = default;

  // One answer per job, in order; a bad job gets its own error (INVALID_ARGUMENT, the text beginning with the
  // field: "source: ...") and leaves its neighbours alone.
  virtual std::vector<absl::StatusOr<TransferResult>> TransferBatch(
      std::span<const TransferJob> jobs) const = 0;
  virtual std::vector<absl::StatusOr<RigResult>> RigBatch(std::span<const RigJob> jobs) const = 0;

  virtual const std::vector<ModelInfo>& models() const = 0;
  virtual const Skeleton& skeleton() const = 0;

  // Transfers a small mesh, so that this thread's first caller doesn't pay for what OpenMP and the networks
  // set up once for each thread that calls them. What Transfer fails with, if it does.
  absl::Status WarmUp() const;

  absl::StatusOr<TransferResult> Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                          const TransferOptions& options = {}) const;
  absl::StatusOr<RigResult> RigMesh(const TriangleMesh& mesh, const TransferOptions& options = {}) const;
};

}  // namespace stance
