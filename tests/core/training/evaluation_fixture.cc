#include "tests/core/training/evaluation_fixture.h"

#include "core/base/check.h"
#include "tests/core/training/small_data.h"
#include "tests/support/untrained_model.h"

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
    const UntrainedModel model(128);
    auto pipeline = Pipeline::Load(model.dir());
    STANCE_CHECK(pipeline.ok());
    return *std::move(pipeline);
  }();
  return *kPipeline;
}

}  // namespace stance::testing
