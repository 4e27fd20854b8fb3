#include "tests/support/untrained_model.h"

#include <fmt/format.h>
#include <unistd.h>

#include "core/base/check.h"
#include "core/network/neural_model.h"
#include "core/network/pose_model.h"
#include "core/network/skeletal_model.h"

namespace stance::testing {
namespace {

absl::Status WriteUntrained(const std::filesystem::path& dir, uint64_t seed, const std::string& method,
                            const ModelManifest& manifest) {
  if (method == kStanceMethod) return PoseModel::WriteUntrained(dir, seed, manifest);
  if (method == kNeuralMethod) return NeuralModel::WriteUntrained(dir, seed, manifest);
  return SkeletalModel::WriteUntrained(dir, seed, manifest);
}

}  // namespace

UntrainedModel::UntrainedModel(int64_t samples, uint64_t seed, const std::string& method)
    : dir_(std::filesystem::temp_directory_path() /
           fmt::format("stance_untrained_{}_{}_{}_{}", getpid(), method, samples, seed)) {
  ModelManifest manifest;
  manifest.name = method == kSkeletalMethod ? "untrained" : "untrained-" + method;
  manifest.version = "test";
  manifest.samples = samples;
  STANCE_CHECK(WriteUntrained(dir_, seed, method, manifest).ok());
}

UntrainedModel::~UntrainedModel() {
  std::error_code ignored;
  std::filesystem::remove_all(dir_, ignored);
}

}  // namespace stance::testing
