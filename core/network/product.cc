#include "core/network/product.h"

namespace stance {
namespace {

using torch::autograd::AutogradContext;
using torch::autograd::tensor_list;

thread_local bool bfloat16_products = false;

struct Bfloat16Function : torch::autograd::Function<Bfloat16Function> {
  static torch::Tensor forward(AutogradContext* ctx, const torch::Tensor& x, const torch::Tensor& w) {
    const auto x_half = x.to(torch::kBFloat16), w_half = w.to(torch::kBFloat16);
    ctx->save_for_backward({x_half, w_half});
    ctx->saved_data["x"] = x.requires_grad();
    return torch::mm(x_half, w_half.t()).to(torch::kFloat32);
  }
  static tensor_list backward(AutogradContext* ctx, const tensor_list& grads) {
    const auto saved = ctx->get_saved_variables();
    const auto gradient = grads[0].to(torch::kBFloat16);
    torch::Tensor for_x;
    if (ctx->saved_data["x"].toBool()) for_x = torch::mm(gradient, saved[1]).to(torch::kFloat32);
    return {for_x, torch::mm(gradient.t(), saved[0]).to(torch::kFloat32)};
  }
};

}  // namespace

torch::Tensor Product(const torch::Tensor& x, const torch::Tensor& w) {
  return bfloat16_products ? Bfloat16Function::apply(x, w) : torch::mm(x, w.t());
}

Bfloat16Products::Bfloat16Products(bool on) : before_(bfloat16_products) { bfloat16_products = on; }
Bfloat16Products::~Bfloat16Products() { bfloat16_products = before_; }

bool CpuMultipliesBfloat16() {
#if defined(__x86_64__)
  // Leaf 7: EDX bit 22 is AMX-BF16. What only has AVX512-BF16 gains too little over float32 to bother.
  unsigned a = 7, b = 0, c = 0, d = 0;
  __asm__("cpuid" : "+a"(a), "=b"(b), "+c"(c), "=d"(d));
  return (d >> 22 & 1) != 0;
#else
  return false;
#endif
}

}  // namespace stance
