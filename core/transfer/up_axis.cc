#include "core/transfer/up_axis.h"

namespace stance {

Eigen::Matrix3f ToYUp(UpAxis up) {
  Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
  if (up == UpAxis::kZ) turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  if (up == UpAxis::kX) turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return turn;
}

}  // namespace stance
