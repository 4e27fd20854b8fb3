// Where the models that are served come from.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/transfer/model_folders.h"
#include "core/transfer/pipeline.h"
#include "core/transfer/rig_cache.h"
#include "server/config.h"

namespace stance {

struct LoadedModels {
  std::shared_ptr<const Pipeline> pipeline;
  std::string stamp;  // tells the files that it was loaded from apart from others
};

// Thread-safe.
class ModelSource {
 public:
  virtual ~ModelSource() = default;

  // Loads, verifies, tests and warms the models. Where the files have the stamp `present`, which is empty at
  // the first time, nothing is loaded: the pipeline is null. An error names the model's path.
  virtual absl::StatusOr<LoadedModels> Load(const std::string& present) const = 0;
};

// The folders and versions that the configuration names; all pipelines keep their rigs in `rig_cache`, or
// none where it is null. Logs what it skips.
std::unique_ptr<ModelSource> MakeFolderSource(const ServerConfig& config,
                                              std::shared_ptr<RigCache> rig_cache);

}  // namespace stance
