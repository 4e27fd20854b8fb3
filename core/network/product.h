// Matrix products of layers in training, in float32 or with bfloat16 operands. Includes Torch.
#pragma once

#include <torch/torch.h>

namespace stance {

// x (N, in) times w (out, in) transposed -> (N, out), differentiable. Under a Bfloat16Products that is on,
// the operands of the product and of its gradients are rounded to bfloat16 (8 bits of mantissa): several
// times faster on CPUs with AMX and on recent GPUs.
torch::Tensor Product(const torch::Tensor& x, const torch::Tensor& w);

// Switches this thread's Product to bfloat16, or not, for its life.
class Bfloat16Products {
 public:
  explicit Bfloat16Products(bool on);
  ~Bfloat16Products();
  Bfloat16Products(const Bfloat16Products&) = delete;
  Bfloat16Products& operator=(const Bfloat16Products&) = delete;

 private:
  bool before_;
};

// Whether bfloat16 products are faster than float32 ones on this CPU.
bool CpuMultipliesBfloat16();

}  // namespace stance
