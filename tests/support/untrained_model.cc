#include "tests/support/untrained_model.h"

#include <fmt/format.h>
#include <unistd.h>

#include "core/base/check.h"
#include "core/network/pose_model.h"
#include "core/network/skeletal_model.h"

namespace stance::testing {

UntrainedModel::UntrainedModel(int64_t samples, uint64_t seed, const std::string& method)
    : dir_(std::filesystem::temp_directory_path() /
           fmt::format("stance_untrained_{}_{}_{}_{}", getpid(), method, samples, seed)) {
  ModelManifest manifest;
  manifest.name = method == kStanceMethod ? "untrained-stance" : "untrained";
  manifest.version = "test";
  manifest.samples = samples;
  const absl::Status written = method == kStanceMethod ? PoseModel::WriteUntrained(dir_, seed, manifest)
                                                       : SkeletalModel::WriteUntrained(dir_, seed, manifest);
  STANCE_CHECK(written.ok());
}

UntrainedModel::~UntrainedModel() {
  std::error_code ignored;
  std::filesystem::remove_all(dir_, ignored);
}

}  // namespace stance::testing
