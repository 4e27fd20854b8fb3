#include "core/training/adamw.h"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>

namespace stance {
namespace {

std::vector<torch::Tensor> Parameters() {
  torch::manual_seed(8);
  return {torch::randn({5, 7}).requires_grad_(), torch::randn({3}).requires_grad_()};
}

// A loss whose gradient differs from step to step.
torch::Tensor Loss(const std::vector<torch::Tensor>& parameters, int step) {
  return (parameters[0].square().sum() * (1 + step % 3) + (parameters[1] - step).square().sum());
}

float Difference(const torch::Tensor& a, const torch::Tensor& b) { return (a - b).abs().max().item<float>(); }

TEST(AdamW, StepsAsTorchDoes) {
  for (const double decay : {0.0, 0.1}) {
    const auto ours = Parameters(), theirs = Parameters();
    AdamW optimizer(ours, decay);
    torch::optim::AdamW reference(theirs, torch::optim::AdamWOptions(0.05).weight_decay(decay));
    for (int step = 0; step < 20; ++step) {
      optimizer.ClearGradients();
      Loss(ours, step).backward();
      const double norm = optimizer.Step(0.05, /*longest=*/2);
      reference.zero_grad();
      Loss(theirs, step).backward();
      EXPECT_NEAR(norm, torch::nn::utils::clip_grad_norm_(theirs, 2), 1e-3);
      reference.step();
      for (size_t p = 0; p < ours.size(); ++p) EXPECT_LT(Difference(ours[p], theirs[p]), 1e-4f) << step;
    }
  }
}

TEST(AdamW, DoesNotMoveAlongAGradientThatIsNotFinite) {
  const auto parameters = Parameters();
  AdamW optimizer(parameters, 0.1);
  const auto before = parameters[0].detach().clone();
  (parameters[0] * std::numeric_limits<float>::infinity()).sum().backward();
  EXPECT_FALSE(std::isfinite(optimizer.Step(0.05, 2)));
  EXPECT_TRUE(parameters[0].equal(before));
}

TEST(AdamW, GoesOnFromWhatItSaved) {
  const auto whole = Parameters(), broken = Parameters();
  AdamW first(whole, 0.1), second(broken, 0.1);
  std::stringstream file;
  for (int step = 0; step < 6; ++step) {
    if (step == 3) {
      torch::serialize::OutputArchive out;
      second.Save(out);
      out.save_to(file);
      second = AdamW(broken, 0.1);
      torch::serialize::InputArchive in;
      in.load_from(file);
      second.Load(in);
    }
    for (auto& [optimizer, parameters] : {std::pair{&first, &whole}, {&second, &broken}}) {
      optimizer->ClearGradients();
      Loss(*parameters, step).backward();
      optimizer->Step(0.05, 2);
    }
  }
  for (size_t p = 0; p < whole.size(); ++p) EXPECT_TRUE(whole[p].equal(broken[p]));
}

}  // namespace
}  // namespace stance
