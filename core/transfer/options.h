// How a transfer is to be made: plain values that server, client and evaluator share with the pipeline.
#pragma once

#include <optional>
#include <string>

#include "core/base/status.h"
#include "core/mesh/mesh_check.h"

namespace stance {

enum class Method {
  kSkeletal,  // paper A: rigid weights, Algorithm 1, diffusion, linear blend skinning
  kStance,    // our own: soft weights and rotations by one network, screened weights, linear blend skinning
  kNeural,    // paper B: sparse soft weights, joints' latents, a decoder in place of linear blend skinning
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

  bool operator==(const SmoothingOptions&) const = default;
};

// How a bone's rotation about its own axis is chosen.
enum class Twist {
  kPaper,      // the smallest rotation between the bones' directions (paper A): the parent's twist is lost
  kInherited,  // the parent's rotation first, then the smallest one that makes the bone point right
};

// Which axis of an input points up; the computation and the answer's frame are explained in
// docs/conventions.md. The target keeps the source's own axes.
enum class UpAxis { kY, kZ, kX };

// Where the target faces (core/transfer/placement.h says what that means).
enum class Facing {
  kReference,  // as the reference does: its orientation is part of the pose
  kSource,     // as the source does: the target is turned about the up axis through its pelvis
};

// Where the target stands along the up axis.
enum class Ground {
  kFree,    // its pelvis where the source's is
  kSource,  // its lowest point as high as the source's
};

struct TransferOptions {
  std::optional<Method> method{};  // unset: the pipeline's default
  SmoothingOptions smoothing{};    // of kSkeletal
  Twist twist = Twist::kPaper;     // of kSkeletal
  UpAxis source_up = UpAxis::kY;
  UpAxis reference_up = UpAxis::kY;
  Facing facing = Facing::kReference;
  Ground ground = Ground::kFree;
  // Most non-zero weights per vertex in the answer and the deformation; 0 keeps all.
  int max_influences = 4;
  // Also smooth the reference's weights, which the transfer itself doesn't need.
  bool reference_weights = false;
  MeshLimits limits{};
};

// INVALID_ARGUMENT, the text beginning with the field, for a value out of its range.
absl::Status CheckOptions(const TransferOptions& options);

}  // namespace stance
