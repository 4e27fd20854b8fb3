#include "core/network/transfer_branch.h"

#include <algorithm>

#include "core/network/skinning_pool.h"

namespace stance {

TransferBranchImpl::TransferBranchImpl() {
  stack = register_module("stack", GkStack(/*batch_norm=*/false));
  joint_layers = register_module("joint_layers", SkeletonEdgeConv(2 * GkStackImpl::kChannels + 2 * 3,
                                                                  std::vector<int64_t>{512, 256, 128}));
  mlp = register_module("mlp", LinearNorm(512 + 256 + 128, 512, false));
  latent = register_module("latent", torch::nn::Linear(512, kLatent));
  decode1 = register_module("decode1", LinearNorm(kLatent + 3, 512, false));
  decode2 = register_module("decode2", LinearNorm(512, 256, false));
  decode3 = register_module("decode3", LinearNorm(256, 128, false));
  out = register_module("out", torch::nn::Linear(128, 3));
}

torch::Tensor TransferBranchImpl::Pool(const PointBatch& batch, const torch::Tensor& weights) {
  return SkinningPool(stack(batch), weights, batch.offsets);
}

torch::Tensor TransferBranchImpl::Latents(const torch::Tensor& source, const torch::Tensor& reference,
                                          const torch::Tensor& source_joints,
                                          const torch::Tensor& reference_joints) {
  const auto known = torch::cat({source, reference, source_joints, reference_joints}, 2);
  const auto rows = joint_layers(known).flatten(0, 1);
  return latent(mlp(rows)).reshape({known.size(0), known.size(1), kLatent});
}

torch::Tensor TransferBranchImpl::Decode(const torch::Tensor& latents, const torch::Tensor& weights,
                                         const torch::Tensor& points, const std::vector<int64_t>& offsets) {
  const auto of_latent = decode1->weight.slice(1, 0, kLatent), of_point = decode1->weight.slice(1, kLatent);
  const auto joints = torch::matmul(latents, of_latent.t());  // (B, 24, 512)
  const auto layers = [&](const torch::Tensor& blended, const torch::Tensor& some) {
    return out(decode3(decode2(Leaky(blended + torch::addmm(decode1->bias, some, of_point.t())))));
  };
  if (is_training() || torch::GradMode::is_enabled()) {
    return layers(SkinningUnpool(joints, weights, offsets), points);
  }
  constexpr int64_t kRows = 1024;  // a block's 512 channels stay in the cache
  auto decoded = torch::empty_like(points);
  for (size_t mesh = 0; mesh + 1 < offsets.size(); ++mesh) {
    const auto of_mesh = joints[static_cast<int64_t>(mesh)];
    for (int64_t begin = offsets[mesh]; begin < offsets[mesh + 1]; begin += kRows) {
      const int64_t end = std::min(begin + kRows, offsets[mesh + 1]);
      decoded.slice(0, begin, end)
          .copy_(layers(torch::mm(weights.slice(0, begin, end), of_mesh), points.slice(0, begin, end)));
    }
  }
  return decoded;
}

torch::Tensor TransferBranchImpl::DecodePlain(const torch::Tensor& latents, const torch::Tensor& weights,
                                              const torch::Tensor& points,
                                              const std::vector<int64_t>& offsets) {
  const auto unpooled = SkinningUnpool(latents, weights, offsets);
  return out(decode3(decode2(decode1(torch::cat({unpooled, points}, 1)))));
}

}  // namespace stance
