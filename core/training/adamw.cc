#include "core/training/adamw.h"

#include <ATen/Parallel.h>
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/base/multiversion.h"

namespace stance {
namespace {

constexpr double kBeta1 = 0.9, kBeta2 = 0.999, kEpsilon = 1e-8;
constexpr int64_t kGrain = 1 << 16;

// One step with everything that is the same for all parameters folded into factors.
struct Factors {
  float clip;         // of the gradient
  float keep;         // of the parameter: 1 - rate decay
  float rate;         // over the first moment's bias correction
  float root_square;  // over the root of the second moment
};

STANCE_MULTIVERSION void Update(const float* __restrict gradient, const Factors& factors, int64_t first,
                                int64_t last, float* __restrict parameter, float* __restrict mean,
                                float* __restrict square) {
  constexpr auto b1 = static_cast<float>(kBeta1), b2 = static_cast<float>(kBeta2);
  const Factors f = factors;
  for (int64_t i = first; i < last; ++i) {
    const float g = f.clip * gradient[i];
    const float m = b1 * mean[i] + (1 - b1) * g;
    const float v = b2 * square[i] + (1 - b2) * g * g;
    mean[i] = m;
    square[i] = v;
    parameter[i] =
        f.keep * parameter[i] - f.rate * m / (std::sqrt(v) * f.root_square + static_cast<float>(kEpsilon));
  }
}

}  // namespace

AdamW::AdamW(std::vector<torch::Tensor> parameters, double weight_decay)
    : parameters_(std::move(parameters)), weight_decay_(weight_decay) {
  for (const torch::Tensor& parameter : parameters_) {
    mean_.push_back(torch::zeros_like(parameter, torch::MemoryFormat::Contiguous).detach());
    square_.push_back(torch::zeros_like(parameter, torch::MemoryFormat::Contiguous).detach());
  }
}

void AdamW::ClearGradients() {
  for (torch::Tensor& parameter : parameters_) parameter.mutable_grad() = torch::Tensor();
}

double AdamW::GradientNorm() const {
  double sum = 0;
  for (const torch::Tensor& parameter : parameters_) {
    if (!parameter.grad().defined()) continue;
    const auto flat = parameter.grad().reshape({-1});
    sum += flat.dot(flat).item<double>();
  }
  return std::sqrt(sum);
}

double AdamW::Step(double learning_rate, double longest) {
  const torch::NoGradGuard no_grad;
  const double norm = GradientNorm();
  if (!std::isfinite(norm)) return norm;
  ++steps_;
  const double correction1 = 1 - std::pow(kBeta1, steps_), correction2 = 1 - std::pow(kBeta2, steps_);
  const double clip = norm > longest ? longest / norm : 1, keep = 1 - learning_rate * weight_decay_;
  const Factors factors{static_cast<float>(clip), static_cast<float>(keep),
                        static_cast<float>(learning_rate / correction1),
                        static_cast<float>(1 / std::sqrt(correction2))};
  for (size_t p = 0; p < parameters_.size(); ++p) {
    if (!parameters_[p].grad().defined()) continue;
    const auto gradient = parameters_[p].grad().contiguous();
    if (!gradient.device().is_cpu()) {
      const auto g = gradient * clip;
      mean_[p].lerp_(g, 1 - kBeta1);
      square_[p].mul_(kBeta2).addcmul_(g, g, 1 - kBeta2);
      parameters_[p].mul_(keep).addcdiv_(mean_[p], square_[p].sqrt().mul_(factors.root_square).add_(kEpsilon),
                                         -static_cast<double>(factors.rate));
      continue;
    }
    at::parallel_for(0, gradient.numel(), kGrain, [&](int64_t first, int64_t last) {
      Update(gradient.data_ptr<float>(), factors, first, last, parameters_[p].data_ptr<float>(),
             mean_[p].data_ptr<float>(), square_[p].data_ptr<float>());
    });
  }
  return norm;
}

void AdamW::Save(torch::serialize::OutputArchive& archive) const {
  archive.write("steps", torch::tensor(steps_));
  for (size_t p = 0; p < parameters_.size(); ++p) {
    archive.write(fmt::format("mean{}", p), mean_[p]);
    archive.write(fmt::format("square{}", p), square_[p]);
  }
}

void AdamW::Load(torch::serialize::InputArchive& archive) {
  torch::Tensor steps;
  archive.read("steps", steps);
  steps_ = steps.item<int64_t>();
  for (size_t p = 0; p < parameters_.size(); ++p) {
    torch::Tensor mean, square;
    archive.read(fmt::format("mean{}", p), mean);
    archive.read(fmt::format("square{}", p), square);
    mean_[p].copy_(mean);
    square_[p].copy_(square);
  }
}

}  // namespace stance
