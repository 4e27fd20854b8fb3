// A trained network of METHOD_STANCE, loaded and ready: the wall between Torch and the rest of Stance.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/network/model_manifest.h"
#include "core/network/pyramid_input.h"
#include "core/skeleton/kinematics.h"

namespace stance {

// A joint is right if its rotation is nearer to the truth than the one and its place nearer than the other,
// on a character of 1.7 m.
inline constexpr double kRightDegrees = 15;
inline constexpr double kRightMillimetres = 30;

struct PoseEstimate {
  RowMatrix weights;  // (N, 24) of the samples, rows sum to 1
  Points canonical;   // (N, 3) of the samples, on the neutral body at rest (training/character.h)
  Points joints;      // (24, 3) in the input's unit and frame
  Points bones;       // (24, 3) from the parent to the joint in the rest pose: canonical frame, input's unit
  std::vector<Rotation> rotations;  // (24) global, from the rest pose
  Eigen::VectorXf confidence;       // (24) probability that a joint is right (above), not calibrated
};

// Which of a model's networks looks: the one that sees meshes as they come, or the one that sees them bent
// back to the rest pose by what the first has found (transfer/pose_refinement.h).
enum class PosePass { kFirst, kRefinement };

// Thread-safe: Infer may run on several threads at once.
class PoseModel {
 public:
  // NOT_FOUND, INVALID_ARGUMENT or DATA_LOSS with the path.
  static absl::StatusOr<std::unique_ptr<PoseModel>> Load(const std::filesystem::path& dir);

  // An untrained model (random weights from `seed`), with a network that refines or without, written as a
  // loadable directory.
  static absl::Status WriteUntrained(const std::filesystem::path& dir, uint64_t seed, ModelManifest manifest,
                                     bool refines = true);

  ~PoseModel();

  const ModelManifest& manifest() const { return manifest_; }
  bool refines() const;             // whether there is a network for PosePass::kRefinement
  int64_t parameter_count() const;  // of all networks

  // One estimate per input, in order, of any sizes; each is the same as if it were alone. Uses up to
  // `threads` threads. INTERNAL if Torch fails, with its words. REQUIRES: the model has the pass.
  absl::StatusOr<std::vector<PoseEstimate>> Infer(std::span<const PyramidInput> inputs, int threads,
                                                  PosePass pass = PosePass::kFirst) const;

 private:
  struct Networks;
  PoseModel();
  ModelManifest manifest_;
  std::unique_ptr<Networks> networks_;
};

}  // namespace stance
