#include "core/transfer/up_axis.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace stance {
namespace {

TEST(ToYUp, IsARotationThatLiftsTheUpAxisToY) {
  for (const auto& [up, axis] :
       {std::pair{UpAxis::kX, 0}, std::pair{UpAxis::kY, 1}, std::pair{UpAxis::kZ, 2}}) {
    const Eigen::Matrix3f turn = ToYUp(up);
    EXPECT_LT((turn * turn.transpose() - Eigen::Matrix3f::Identity()).norm(), 1e-6f);
    EXPECT_NEAR(turn.determinant(), 1, 1e-6);
    EXPECT_EQ(turn.col(axis), Eigen::Vector3f::UnitY());
  }
}

}  // namespace
}  // namespace stance
