// A trained pair of paper B's branches, loaded and ready: the wall between Torch and the rest of Stance.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/network/model_manifest.h"
#include "core/network/network_input.h"

namespace stance {

// What the networks find in one mesh.
struct NeuralRig {
  RowMatrix weights;   // (N, 24) of the samples (paper B, equation 5), rows sum to 1
  Points joints;       // (24, 3) in the input's unit and frame
  RowMatrix features;  // (24, 451) O: the transfer branch's features of the samples, pooled (equation 10)
};

// What the transfer branch needs to know of a mesh: all of it lies in the joints.
struct NeuralCharacter {
  RowMatrix features;           // (24, 451), NeuralRig's
  Points joints;                // (24, 3), in the mesh's unit and frame
  Normalization normalization;  // of the samples that both come from
};

// Thread-safe: const calls may run on several threads at once.
class NeuralModel {
 public:
  // NOT_FOUND, INVALID_ARGUMENT or DATA_LOSS with the path.
  static absl::StatusOr<std::unique_ptr<NeuralModel>> Load(const std::filesystem::path& dir);

  // An untrained model (random weights from `seed`), written as a loadable directory.
  static absl::Status WriteUntrained(const std::filesystem::path& dir, uint64_t seed, ModelManifest manifest);

  ~NeuralModel();

  const ModelManifest& manifest() const { return manifest_; }
  int64_t parameter_count() const;  // of both branches

  // One rig per input, in order, of any sizes; each is the same as if it were alone. Uses up to `threads`
  // threads. INTERNAL if Torch fails, with its words.
  absl::StatusOr<std::vector<NeuralRig>> Infer(std::span<const NetworkInput> inputs, int threads) const;

  // The source in the reference's pose (equations 11 to 14): any points of its surface (V, 3), with their
  // weights (V, 24), to their places (V, 3), all in the source's unit and frame. Uses up to `threads`
  // threads. INTERNAL if Torch fails, with its words.
  absl::StatusOr<Points> Deform(const NeuralCharacter& source, const NeuralCharacter& reference,
                                const Points& points, const RowMatrix& weights, int threads) const;

 private:
  struct Networks;
  NeuralModel();
  ModelManifest manifest_;
  std::unique_ptr<Networks> networks_;
};

}  // namespace stance
