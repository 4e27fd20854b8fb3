// The optimiser: AdamW (Loshchilov and Hutter, Decoupled Weight Decay Regularization, 2019; Adam where the
// decay is zero) in one pass over the parameters, with the gradient clipped. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <vector>

namespace stance {

// Not thread-safe.
class AdamW {
 public:
  AdamW(std::vector<torch::Tensor> parameters, double weight_decay);

  void ClearGradients();

  // One step along the gradients, scaled down to `longest` in norm if they are longer. Returns the norm they
  // had; if it is not finite, nothing moves.
  double Step(double learning_rate, double longest);

  void Save(torch::serialize::OutputArchive& archive) const;
  void Load(torch::serialize::InputArchive& archive);

 private:
  double GradientNorm() const;

  std::vector<torch::Tensor> parameters_, mean_, square_;  // the same shapes
  double weight_decay_;
  int64_t steps_ = 0;
};

}  // namespace stance
