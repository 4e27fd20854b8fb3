// Resumable training state. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/status.h"
#include "core/network/pyramid_input.h"
#include "core/training/adamw.h"

namespace stance {

// A stage's networks, by name.
using NamedModules = std::vector<std::pair<std::string, std::shared_ptr<torch::nn::Module>>>;

struct TrainingProgress {
  int64_t seen = 0;  // characters
  int64_t samples_per_mesh = 0;
  int64_t max_ring = 0;
  double seconds = 0;  // spent so far
  InputFeatures features{};
};

// Modules and optimiser in one file, written aside and renamed. The modules are those of the stage, by name.
absl::Status SaveCheckpoint(const std::filesystem::path& path, const NamedModules& modules, AdamW* optimizer,
                            const TrainingProgress& progress);

// Puts all tensors on `device`, wherever they were saved. NOT_FOUND where there is none; DATA_LOSS with the
// path for a damaged one. `optimizer` may be null.
absl::StatusOr<TrainingProgress> LoadCheckpoint(const std::filesystem::path& path,
                                                const NamedModules& modules, AdamW* optimizer,
                                                torch::Device device);

// Puts what the checkpoint knows of the modules into them, by name and shape; the rest of them stays as it
// is. Returns how many tensors were taken. Errors as LoadCheckpoint's.
absl::StatusOr<int> LoadMatching(const std::filesystem::path& path, const NamedModules& modules,
                                 torch::Device device);

}  // namespace stance
