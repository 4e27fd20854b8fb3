#include "core/mesh/nearest_rows.h"

#include <gtest/gtest.h>

#include "tests/support/meshes.h"

namespace stance {
namespace {

using testing::Icosphere;

TEST(NearestRow, AgreesWithTheDefinition) {
  const Points points = Icosphere(2).positions, queries = Icosphere(3, 1.3f).positions;
  const auto nearest = NearestRow(queries, points);
  for (int64_t i = 0; i < queries.rows(); ++i) {
    const float best = (points.rowwise() - queries.row(i)).rowwise().norm().minCoeff();
    EXPECT_NEAR((points.row(nearest[i]) - queries.row(i)).norm(), best, 1e-6f);
  }
}

TEST(NearestRows, AreTheDefinitions) {
  const Points points = testing::Capsule(1.2f, 0.3f).positions;
  const NeighborTable nearest = NearestRows(points, points, 9);
  ASSERT_EQ(nearest.rows(), points.rows());
  for (int64_t i = 0; i < points.rows(); ++i) {
    EXPECT_EQ(nearest(i, 0), i);
    std::vector<float> distances;
    for (int64_t j = 0; j < points.rows(); ++j) distances.push_back((points.row(i) - points.row(j)).norm());
    std::sort(distances.begin(), distances.end());
    for (int n = 0; n < 9; ++n) {
      EXPECT_NEAR((points.row(i) - points.row(nearest(i, n))).norm(), distances[n], 1e-6f);
    }
  }
}

TEST(NearestRows, RepeatTheLastWhereThereAreTooFew) {
  Points points(2, 3);
  points << 0, 0, 0, 1, 0, 0;
  const NeighborTable nearest = NearestRows(points, points, 4);
  EXPECT_EQ(nearest(1, 0), 1);
  for (int n = 1; n < 4; ++n) EXPECT_EQ(nearest(1, n), 0);
}

}  // namespace
}  // namespace stance
