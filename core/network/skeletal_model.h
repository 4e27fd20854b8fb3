// A trained pair of paper A's networks, loaded and ready: the wall between Torch and the rest of Stance.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/network/model_manifest.h"
#include "core/network/network_input.h"

namespace stance {

struct SkeletalPrediction {
  std::vector<int32_t> joint_of;  // (N) the joint each sample is bound to (paper A, equation 1)
  RowMatrix confidence;           // (N, 24) softmax of f_C
  Points joints;                  // (24, 3) from f_J, in the input's unit and frame
};

// Thread-safe: Infer may run on several threads at once.
class SkeletalModel {
 public:
  // NOT_FOUND, INVALID_ARGUMENT or DATA_LOSS with the path.
  static absl::StatusOr<std::unique_ptr<SkeletalModel>> Load(const std::filesystem::path& dir);

  // An untrained model (random weights from `seed`), written as a loadable directory.
  static absl::Status WriteUntrained(const std::filesystem::path& dir, uint64_t seed,
                                     const ModelManifest& manifest);

  ~SkeletalModel();

  const ModelManifest& manifest() const { return manifest_; }
  int64_t parameter_count() const;

  // One prediction per input, in order, of any sizes; each is the same as if it were alone. Uses up to
  // `threads` threads. INTERNAL if Torch fails, with its words.
  absl::StatusOr<std::vector<SkeletalPrediction>> Infer(std::span<const NetworkInput> inputs,
                                                        int threads) const;

 private:
  struct Networks;
  SkeletalModel();
  ModelManifest manifest_;
  std::unique_ptr<Networks> networks_;
};

}  // namespace stance
