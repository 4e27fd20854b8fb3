// The parts a pose-transfer method is composed of. Each is pure: const, thread-safe, no state between calls.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/resample.h"
#include "core/mesh/triangle_mesh.h"
#include "core/skeleton/kinematics.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// Weights known at samples of a mesh's surface.
struct SampledWeights {
  SurfaceSamples samples;
  RowMatrix weights;  // (N, J), rows non-negative and summing to 1
};

// A mesh's skeleton and how its vertices are bound to it.
struct Rig {
  Points joints;      // (J, 3), in the mesh's own frame and unit
  RowMatrix weights;  // (V, J), rows non-negative and summing to 1; constant over each sample's cell before
                      // smoothing
  // What `weights` were taken from, where the rigger's smoother needs it.
  std::shared_ptr<const SampledWeights> sampled{};
  // (J, 3) from the parent to the joint in the rest pose, in the canonical frame and the mesh's unit; (J)
  // each joint's global rotation from the rest pose, from the canonical frame to the mesh's own; and the
  // probability, in [0, 1], that it and the joint's place are right. Empty where the rigger does not know
  // them.
  Points bones{};
  std::vector<Rotation> rotations{};
  Eigen::VectorXf confidence{};
  // (J, C) what the rigger's networks know of each joint beyond its place: for the PairDeformer that shares
  // them. Empty where there is none.
  RowMatrix features{};
};

// Seconds spent in each phase of one request (its share, where a phase ran for a whole batch).
struct PhaseSeconds {
  double check = 0;
  double resample = 0;
  double network = 0;
  double pose = 0;
  double weights = 0;
  double deform = 0;
  double total = 0;
};

// Mesh to joints and weights.
class Rigger {
 public:
  virtual ~Rigger() = default;

  // One rig per mesh, in order; the result for a mesh does not depend on its neighbours in the batch.
  // Adds what the whole batch took to `seconds`. REQUIRES: every mesh has passed CheckMesh.
  virtual absl::StatusOr<std::vector<Rig>> RigMeshes(std::span<const TriangleMesh* const> meshes,
                                                     PhaseSeconds& seconds) const = 0;

  virtual const Skeleton& skeleton() const = 0;
};

// Two rigged characters to the global rotation of each source joint that gives the source the reference's
// pose (source -> target).
class PoseSolver {
 public:
  virtual ~PoseSolver() = default;
  virtual std::vector<Rotation> Solve(const Skeleton& skeleton, const TriangleMesh& source,
                                      const Rig& source_rig, const TriangleMesh& reference,
                                      const Rig& reference_rig) const = 0;
};

// A rig's rough weights to smooth ones (V, J): non-negative, rows sum to 1.
class WeightSmoother {
 public:
  virtual ~WeightSmoother() = default;
  virtual absl::StatusOr<RowMatrix> Smooth(const TriangleMesh& mesh, const Rig& rig) const = 0;
};

// Rest vertices (V, 3), weights (V, J) and J transforms to deformed vertices (V, 3).
class Deformer {
 public:
  virtual ~Deformer() = default;
  virtual Points Deform(const Points& vertices, const RowMatrix& weights,
                        std::span<const AffineTransform> transforms) const = 0;
};

// Two rigged characters to the source in the reference's pose, for methods that deform without transforms.
class PairDeformer {
 public:
  virtual ~PairDeformer() = default;

  // The places (V, 3) of the source's vertices (V, 3), with their smooth weights (V, J), in the reference's
  // pose; all in the source's frame and unit, and the root joint where it is. Uses up to `threads` threads.
  virtual absl::StatusOr<Points> Deform(const Points& vertices, const RowMatrix& weights, const Rig& source,
                                        const Rig& reference, int threads) const = 0;
};

}  // namespace stance
