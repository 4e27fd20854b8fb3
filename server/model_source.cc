#include "server/model_source.h"

#include <filesystem>
#include <utility>

#include "core/transfer/self_test.h"
#include "server/log.h"

namespace stance {
namespace {

class FolderSource : public ModelSource {
 public:
  FolderSource(const ServerConfig& config, std::shared_ptr<RigCache> rig_cache)
      : directories_(config.model_directory.begin(), config.model_directory.end()),
        pins_(ParseVersionPins(config.model_versions).value()),  // FinishConfig has passed
        options_{.threads = static_cast<int>(config.inference_threads), .rig_cache = std::move(rig_cache)} {}

  absl::StatusOr<LoadedModels> Load(const std::string& present) const override {
    STANCE_ASSIGN_OR_RETURN(const ModelFolders found, FindModelFolders(directories_, pins_));
    for (const std::filesystem::path& folder : found.skipped) {
      Log(LogLevel::kWarn, "model version skipped",
          {{"folder", folder.string()}, {"error", "no manifest: it is not written to its end"}});
    }
    // Taken before the files are read, so that what changes meanwhile is loaded the next time.
    LoadedModels loaded{.pipeline = nullptr, .stamp = StampOf(found.models)};
    if (!present.empty() && loaded.stamp == present) return loaded;
    STANCE_ASSIGN_OR_RETURN(loaded.pipeline, Pipeline::Load(found.models, options_));
    std::vector<std::string> untested;
    STANCE_RETURN_IF_ERROR(RunSelfTests(*loaded.pipeline, found.models, untested));
    for (const std::string& folder : untested) {
      Log(LogLevel::kWarn, "model without a self-test", {{"folder", folder}});
    }
    STANCE_RETURN_IF_ERROR(loaded.pipeline->WarmUp());
    return loaded;
  }

 private:
  const std::vector<std::filesystem::path> directories_;
  const VersionPins pins_;
  const PipelineOptions options_;
};

}  // namespace

std::unique_ptr<ModelSource> MakeFolderSource(const ServerConfig& config,
                                              std::shared_ptr<RigCache> rig_cache) {
  return std::make_unique<FolderSource>(config, std::move(rig_cache));
}

}  // namespace stance
