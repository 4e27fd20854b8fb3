#include "core/network/network_input.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

TEST(Normalization, ThenItsInverseIsTheIdentity) {
  const Points points = Points::Random(50, 3) * 3;
  const Normalization n = NormalizationOf(points);
  EXPECT_LT((n.Invert(n.Apply(points)) - points).cwiseAbs().maxCoeff(), 1e-5f);
}

TEST(Normalization, CentresTheBoxAndGivesItAUnitDiagonal) {
  const Points normalized = NormalizationOf(Points::Random(50, 3)).Apply(Points::Random(50, 3));
  const Points own = Points::Random(80, 3);
  const Points box = NormalizationOf(own).Apply(own);
  const Eigen::RowVector3f low = box.colwise().minCoeff(), high = box.colwise().maxCoeff();
  EXPECT_LT((low + high).norm(), 1e-5f);
  EXPECT_NEAR((high - low).norm(), 1, 1e-5f);
  EXPECT_TRUE(normalized.allFinite());
}

TEST(Normalization, UndoesTranslationAndScale) {
  const Points points = Points::Random(50, 3);
  const Points moved = (points * 100).rowwise() + Eigen::RowVector3f(5, -7, 11);
  EXPECT_LT(
      (NormalizationOf(points).Apply(points) - NormalizationOf(moved).Apply(moved)).cwiseAbs().maxCoeff(),
      1e-4f);
}

TEST(Normalization, OfASinglePointDividesByOne) { EXPECT_EQ(NormalizationOf(Points::Ones(4, 3)).scale, 1); }

}  // namespace
}  // namespace stance
