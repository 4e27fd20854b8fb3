// The rigging branch of METHOD_NEURAL (paper B, section 3.1). Includes Torch.
#pragma once

#include <torch/torch.h>

#include "core/network/skeletal_networks.h"

namespace stance {

struct RiggingPrediction {
  torch::Tensor weights;  // (N, 24) W = SparseSoftmax(f_s(M)) (equations 4 to 6)
  torch::Tensor joints;   // (B, 24, 3) C = f_c(M, W) (equation 7), normalised as the points are
};

// f_s and f_c have the widths of paper A's f_C and f_J, since the paper gives none: 3,377,691 parameters. f_c
// pools its features by the soft weights, so that its loss reaches f_s.
class RiggingBranchImpl : public torch::nn::Module {
 public:
  RiggingBranchImpl();
  RiggingPrediction forward(const PointBatch& batch);

  WeightNetwork f_s{nullptr};
  JointNetwork f_c{nullptr};
};
TORCH_MODULE(RiggingBranch);

}  // namespace stance
