#include "core/training/evaluation_ablations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/core/training/evaluation_fixture.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class AblateStanceTest : public ::testing::Test {
 protected:
  AblateStanceTest()
      : pair_(testing::SmallGenerator().MakePair(3, 0, {.split = Split::kTest})),
        files_(128, 2, kStanceMethod),
        model_(*PoseModel::Load(files_.dir())),
        candidates_(AblateStance(*model_, pair_)) {}

  const Points& Positions(const std::string& name) const {
    const auto found = std::find_if(candidates_.begin(), candidates_.end(),
                                    [&name](const Candidate& candidate) { return candidate.method == name; });
    EXPECT_NE(found, candidates_.end()) << name;
    EXPECT_TRUE(found->positions.ok()) << found->positions.status();
    return *found->positions;
  }

  const TransferPair pair_;
  const testing::UntrainedModel files_;
  const std::unique_ptr<PoseModel> model_;
  const std::vector<Candidate> candidates_;
};

TEST_F(AblateStanceTest, TheFirstRowIsThePipelines) {
  const auto pipeline = *Pipeline::Load(files_.dir());
  const auto result = pipeline->Transfer(pair_.source.mesh, pair_.reference.mesh, {.max_influences = 0});
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(candidates_.front().method, "METHOD_STANCE");
  EXPECT_LT((Positions("METHOD_STANCE") - result->target.positions).rowwise().norm().maxCoeff(), 1e-4f);
}

TEST_F(AblateStanceTest, EveryRowIsAResultOfItsOwn) {
  std::set<std::string> names;
  for (const Candidate& candidate : candidates_) {
    EXPECT_TRUE(names.insert(candidate.method).second) << candidate.method;
    EXPECT_TRUE(Positions(candidate.method).allFinite()) << candidate.method;
    // A mesh may well be seen best as it stands.
    if (candidate.method == "METHOD_STANCE" || candidate.method == "upright looks only") continue;
    EXPECT_GT((Positions(candidate.method) - Positions("METHOD_STANCE")).norm(), 1e-4f) << candidate.method;
  }
}

// All three parts true is ComposeParts' last row; any two of them leave one part's error.
TEST_F(AblateStanceTest, TrueJointsAndRotationsKeepTheBonesInPlace) {
  const auto error = [this](const std::string& name) {
    return Judge("p", {.method = name, .positions = Positions(name)}, pair_.truth, pair_.source.mesh.faces,
                 pair_.source.stature)
        .errors.mean_mm;
  };
  EXPECT_LT(error("true joints and rotations"), error("true joints"));
  EXPECT_LT(error("true weights and rotations"), error("true weights"));
}

}  // namespace
}  // namespace stance
