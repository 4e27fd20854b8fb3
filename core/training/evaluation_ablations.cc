#include "core/training/evaluation_ablations.h"

#include <array>
#include <string>
#include <utility>

#include "core/training/evaluation_pairs.h"
#include "core/transfer/bone_rotation_solver.h"
#include "core/transfer/learned_rotation_solver.h"
#include "core/transfer/linear_blend_skinning.h"
#include "core/transfer/pose_rigger.h"
#include "core/transfer/screened_weights.h"

namespace stance {
namespace {

constexpr PoseEstimationOptions kFourViews = {.samplings = 1, .views = 4, .refinement_views = 2};

struct Rigs {
  Rig source, reference;
};

absl::StatusOr<Rigs> RigPair(const TransferPair& pair, const PoseRigger& rigger) {
  const std::array<const TriangleMesh*, 2> meshes = {&pair.source.mesh, &pair.reference.mesh};
  PhaseSeconds seconds;
  STANCE_ASSIGN_OR_RETURN(std::vector<Rig> rigs, rigger.RigMeshes(meshes, seconds));
  return Rigs{std::move(rigs[0]), std::move(rigs[1])};
}

std::vector<Rotation> Solve(const PoseSolver& solver, const TransferPair& pair, const Rigs& rigs) {
  return solver.Solve(HumanSkeleton(), pair.source.mesh, rigs.source, pair.reference.mesh, rigs.reference);
}

absl::StatusOr<RowMatrix> Weights(const TransferPair& pair, const Rig& rig) {
  return ScreenedSmoother().Smooth(pair.source.mesh, rig);
}

Points Deform(const TransferPair& pair, const Points& joints, const RowMatrix& weights,
              const std::vector<Rotation>& turns) {
  return LinearBlendSkinning().Deform(pair.source.mesh.positions, weights,
                                      PoseTransforms(HumanSkeleton(), joints, turns));
}

// The method as it is, with this rigger.
absl::StatusOr<Points> TransferBy(const TransferPair& pair, const PoseRigger& rigger) {
  STANCE_ASSIGN_OR_RETURN(const Rigs rigs, RigPair(pair, rigger));
  STANCE_ASSIGN_OR_RETURN(const RowMatrix weights, Weights(pair, rigs.source));
  return Deform(pair, rigs.source.joints, weights, Solve(LearnedRotationSolver(), pair, rigs));
}

}  // namespace

std::vector<Candidate> AblateStance(const PoseModel& model, const TransferPair& pair) {
  const absl::StatusOr<Rigs> rigs = RigPair(pair, PoseRigger(model, /*threads=*/1));
  if (!rigs.ok()) return {{.method = "METHOD_STANCE", .positions = rigs.status()}};
  const absl::StatusOr<RowMatrix> smooth = Weights(pair, rigs->source);
  if (!smooth.ok()) return {{.method = "METHOD_STANCE", .positions = smooth.status()}};

  const Points &joints = rigs->source.joints, &true_joints = pair.source.joints;
  const RowMatrix &weights = *smooth, &true_weights = pair.source.weights;
  const std::vector<Rotation> turns = Solve(LearnedRotationSolver(), pair, *rigs);
  const std::vector<Rotation> true_turns = TrueRotations(pair);

  std::vector<Candidate> candidates;
  const auto add = [&candidates](std::string name, absl::StatusOr<Points> positions) {
    candidates.push_back({.method = std::move(name), .positions = std::move(positions)});
  };
  add("METHOD_STANCE", Deform(pair, joints, weights, turns));
  add("one sampling in one view", TransferBy(pair, PoseRigger(model, 1, {.samplings = 1})));
  add("one sampling in four views", TransferBy(pair, PoseRigger(model, 1, kFourViews)));
  add("two samplings", TransferBy(pair, PoseRigger(model, 1, {.samplings = 2})));
  add("six samplings", TransferBy(pair, PoseRigger(model, 1, {.samplings = 6})));
  add("upright looks only", TransferBy(pair, PoseRigger(model, 1, {.least_confidence = 0})));
  add("no second look", TransferBy(pair, PoseRigger(model, 1, {.refinement_views = 0})));
  add("joints as found", TransferBy(pair, PoseRigger(model, 1, {.joint_stiffness = 0})));
  const LearnedRotationSolver uncorrected(/*correction=*/0);
  add("rotations not corrected by bones", Deform(pair, joints, weights, Solve(uncorrected, pair, *rigs)));
  for (const Twist twist : {Twist::kInherited, Twist::kPaper}) {
    const std::string name = twist == Twist::kPaper ? "paper A's" : "inherited twist";
    add("rotations from bone directions, " + name,
        Deform(pair, joints, weights, Solve(BoneRotationSolver(twist), pair, *rigs)));
  }
  add("weights of the nearest sample", Deform(pair, joints, rigs->source.weights, turns));
  add("true joints", Deform(pair, true_joints, weights, turns));
  add("true weights", Deform(pair, joints, true_weights, turns));
  add("true rotations", Deform(pair, joints, weights, true_turns));
  add("true joints and weights", Deform(pair, true_joints, true_weights, turns));
  add("true joints and rotations", Deform(pair, true_joints, weights, true_turns));
  add("true weights and rotations", Deform(pair, joints, true_weights, true_turns));
  return candidates;
}

}  // namespace stance
