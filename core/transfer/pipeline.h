// The whole pose transfer as one call: what the server, the CLI and the evaluator share.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "core/network/model_manifest.h"
#include "core/transfer/options.h"
#include "core/transfer/parts.h"

namespace stance {

class RigCache;
// A source that was rigged once, for the transfer of many references. Immutable.
struct RiggedSource;

// One mesh with its skeleton and smooth weights. Joints are in the mesh's own frame and unit.
struct RigResult {
  Rig rig;
  std::string model;  // the name of the one that answered
  std::vector<std::string> warnings;
  PhaseSeconds seconds;
};

struct TransferResult {
  TriangleMesh target;  // the source's faces, texture coordinates and groups; new positions (and normals)
  Rig source_rig;       // smooth weights
  Rig reference_rig;    // smooth weights; no rows unless options.reference_weights
  Points target_joints;
  // (J) source -> target, in the source's frame and unit. Of kNeural, which deforms without them, those whose
  // rotations fit the target best: skinning by them gives it nearly.
  std::vector<AffineTransform> transforms;
  // core/transfer/confidence.h's; unset if the method does not know it.
  std::optional<float> confidence;
  std::string model;                  // the name of the one that answered
  std::vector<std::string> warnings;  // "source: 3 degenerate faces (first: face 17)"
  PhaseSeconds seconds;
};

// Whether the caller has given a job up. Asked between phases, from any of the batch's threads, also at the
// same time; empty: never.
using GivenUp = std::function<bool()>;

struct TransferJob {
  const TriangleMesh* source = nullptr;
  const TriangleMesh* reference = nullptr;
  TransferOptions options;
  GivenUp given_up{};
  // What RigSources made of the same source with the same options (reference_up may differ): then it isn't
  // rigged again. Null, or of another pipeline: it is.
  std::shared_ptr<const RiggedSource> rigged{};
};

struct RigJob {
  const TriangleMesh* mesh = nullptr;
  TransferOptions options;  // method, source_up, smoothing, max_influences and limits apply
  GivenUp given_up{};
};

struct RigSourceResult {
  std::shared_ptr<const RiggedSource> rigged;
  PhaseSeconds seconds;
};

struct PipelineOptions {
  // Threads one call may use. workers x threads should not exceed CpuQuota().
  int threads = 1;
  // Let the networks see every vertex in place of the model's number of samples (paper A's own way). Slower,
  // and worse on meshes whose vertices aren't as dense as the samples that the model was trained on.
  bool full_resolution = false;
  // Keeps the rigs of meshes in case that they come again; several pipelines may share it. Null: none are
  // kept.
  std::shared_ptr<RigCache> rig_cache{};
};

struct ModelInfo {
  std::string name;     // e.g. "skeletal-human24"
  std::string version;  // from the model's manifest
  Method method = Method::kSkeletal;
  int joint_count = 0;
  int64_t parameter_count = 0;
  int64_t sample_count = 0;          // surface samples the networks see
  ConfidenceCalibration confidence;  // which its confidences have been through
};

// Loads once, transfers many; serves one model of each method, chosen per job. Thread-safe: const calls may
// run at the same time.
class Pipeline {
 public:
  // Loads the models in `folders`: each is a model's own folder (models/README.md says what lies there) or
  // holds such folders, all of which are loaded. NOT_FOUND, INVALID_ARGUMENT or DATA_LOSS, with the path, for
  // a model that is missing, unknown or damaged; INVALID_ARGUMENT for two models of one method or of one
  // name.
  static absl::StatusOr<std::unique_ptr<Pipeline>> Load(const std::vector<std::filesystem::path>& folders,
                                                        const PipelineOptions& options = {});
  static absl::StatusOr<std::unique_ptr<Pipeline>> Load(const std::filesystem::path& folder,
                                                        const PipelineOptions& options = {}) {
    return Load(std::vector{folder}, options);
  }
  virtual ~Pipeline() = default;

  // One answer per job, in order; a bad job gets its own error (INVALID_ARGUMENT, the text beginning with the
  // field: "source: ..."; FAILED_PRECONDITION for a method without a model here) and leaves its neighbours
  // alone; one that is given up gets CANCELLED and no further work. Jobs of one method go through its
  // networks together.
  virtual std::vector<absl::StatusOr<TransferResult>> TransferBatch(
      std::span<const TransferJob> jobs) const = 0;
  virtual std::vector<absl::StatusOr<RigResult>> RigBatch(std::span<const RigJob> jobs) const = 0;
  // For TransferJob::rigged. Errors as TransferBatch's about a source.
  virtual std::vector<absl::StatusOr<RigSourceResult>> RigSources(std::span<const RigJob> jobs) const = 0;

  // At least one. The first is that of the default method: kStance if there is one, otherwise the first
  // loaded.
  virtual const std::vector<ModelInfo>& models() const = 0;
  virtual const Skeleton& skeleton() const = 0;

  // Transfers a small mesh with each model, past the cache, so that this thread's first callers don't pay for
  // what OpenMP and the networks set up once for each thread that calls them. What Transfer fails with, if it
  // does.
  virtual absl::Status WarmUp() const = 0;

  absl::StatusOr<TransferResult> Transfer(const TriangleMesh& source, const TriangleMesh& reference,
                                          const TransferOptions& options = {}) const;
  absl::StatusOr<RigResult> RigMesh(const TriangleMesh& mesh, const TransferOptions& options = {}) const;
};

}  // namespace stance
