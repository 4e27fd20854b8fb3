#include "tests/core/training/evaluation_fixture.h"

#include "core/base/check.h"
#include "core/network/skeletal_model.h"
#include "tests/core/training/small_data.h"

namespace stance::testing {

const CharacterGenerator& SmallGenerator() {
  static const std::unique_ptr<CharacterGenerator> kGenerator = [] {
    const TemporaryFolder folder;
    WriteSmallBody(folder.path() / "mpfb");
    WriteSmallMotions(folder.path() / "bvh", 20);
    auto generator = CharacterGenerator::FromData(folder.path() / "mpfb", folder.path() / "bvh");
    STANCE_CHECK(generator.ok());
    return *std::move(generator);
  }();
  return *kGenerator;
}

const Pipeline& UntrainedPipeline() {
  static const std::unique_ptr<Pipeline> kPipeline = [] {
    const TemporaryFolder folder;
    ModelManifest manifest;
    manifest.name = "untrained";
    manifest.version = std::string("0");  // GCC 12 warns of -Wrestrict for a short literal
    manifest.samples = 128;
    STANCE_CHECK(SkeletalModel::WriteUntrained(folder.path() / "model", 1, manifest).ok());
    auto pipeline = Pipeline::Load(folder.path() / "model");
    STANCE_CHECK(pipeline.ok());
    return *std::move(pipeline);
  }();
  return *kPipeline;
}

}  // namespace stance::testing
