#include "core/network/rigging_branch.h"

#include "core/network/sparse_softmax.h"

namespace stance {

RiggingBranchImpl::RiggingBranchImpl() {
  f_s = register_module("f_s", WeightNetwork());
  f_c = register_module("f_c", JointNetwork());
}

RiggingPrediction RiggingBranchImpl::forward(const PointBatch& batch) {
  RiggingPrediction prediction;
  prediction.weights = SparseSoftmax(f_s(batch));
  prediction.joints = f_c(batch, prediction.weights);
  return prediction;
}

}  // namespace stance
