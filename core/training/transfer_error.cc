#include "core/training/transfer_error.h"

#include "core/network/tensors.h"
#include "core/skeleton/skeleton.h"

namespace stance {
namespace {

// (24, 24): 1 where the column's joint is the row's or one of its ancestors.
torch::Tensor Chains() {
  const std::vector<int>& parents = HumanSkeleton().parents();
  auto chains = torch::zeros({kHumanJoints, kHumanJoints});
  for (int j = 0; j < kHumanJoints; ++j) {
    for (int a = j; a >= 0; a = parents[a]) chains[j][a] = 1;
  }
  return chains;
}

torch::Tensor Parents() {
  std::vector<int64_t> parents(HumanSkeleton().parents().begin(), HumanSkeleton().parents().end());
  parents[kPelvis] = kPelvis;
  return torch::tensor(parents);
}

torch::Tensor Apply(const torch::Tensor& rotations, const torch::Tensor& vectors) {
  return torch::matmul(rotations, vectors.unsqueeze(-1)).squeeze(-1);
}

torch::Tensor UnitVectors(const torch::Tensor& vectors) {
  constexpr double kTiny = 1e-8;  // keeps the gradient of no length finite
  return vectors / (vectors.square().sum(-1, /*keepdim=*/true) + kTiny).sqrt();
}

// The smallest rotations (..., 3, 3) from unit vectors (..., 3) to others. Not one where they are opposite.
torch::Tensor SmallestRotations(const torch::Tensor& from, const torch::Tensor& to) {
  const auto axis = torch::cross(from, to, -1);
  const auto x = axis.select(-1, 0), y = axis.select(-1, 1), z = axis.select(-1, 2);
  const auto zero = torch::zeros_like(x);
  const auto cross = torch::stack({zero, -z, y, z, zero, -x, -y, x, zero}, -1).unflatten(-1, {3, 3});
  constexpr double kLeast = 0.05;  // of 1 + cos
  const auto divisor = (1 + (from * to).sum(-1)).clamp_min(kLeast).unsqueeze(-1).unsqueeze(-1);
  return torch::eye(3, from.options()) + cross + torch::matmul(cross, cross) / divisor;
}

}  // namespace

torch::Tensor CorrectedByBones(const torch::Tensor& rotations, const torch::Tensor& joints,
                               const torch::Tensor& bones, double correction) {
  std::vector<int64_t> corrected, children;
  for (int j = 0; j < kHumanJoints; ++j) {
    if (HumanSkeleton().children(j).size() != 1) continue;
    corrected.push_back(j);
    children.push_back(HumanSkeleton().children(j)[0]);
  }
  const auto device = rotations.device();
  const auto own = torch::tensor(corrected).to(device), child = torch::tensor(children).to(device);
  const auto learned = rotations.index_select(1, own);
  const auto found = UnitVectors(Apply(learned, bones.index_select(1, child)));
  const auto wanted = UnitVectors(joints.index_select(1, child) - joints.index_select(1, own));
  const auto turns = SmallestRotations(found, UnitVectors(found + correction * (wanted - found)));
  return rotations.index_copy(1, own, torch::matmul(turns, learned));
}

torch::Tensor DeformToNext(const torch::Tensor& points, const RigBatch& rigs,
                           const std::vector<int64_t>& offsets) {
  const auto device = points.device();
  const auto parents = Parents().to(device);
  const auto turns = torch::matmul(rigs.rotations.roll({-1}, {0}), rigs.rotations.transpose(2, 3));
  // From the parent to each joint, turned with the parent; at the root, from the origin, not turned.
  const auto& joints = rigs.joints;
  const auto bones =
      Apply(turns.index_select(1, parents), joints - joints.index_select(1, parents)) +
      torch::cat({joints.narrow(1, 0, 1), torch::zeros_like(joints.narrow(1, 1, kHumanJoints - 1))}, 1);
  const auto posed = torch::matmul(Chains().to(device), bones);
  const auto transforms = torch::cat({turns, (posed - Apply(turns, joints)).unsqueeze(-1)}, 3).flatten(2);

  const std::vector<int64_t> sizes = RowsPerMesh(offsets);
  const auto weights_of = rigs.weights.split_with_sizes(sizes);
  std::vector<torch::Tensor> blended;
  for (size_t mesh = 0; mesh < sizes.size(); ++mesh) {
    blended.push_back(torch::mm(weights_of[mesh], transforms[static_cast<int64_t>(mesh)]));
  }
  const auto transform_of = torch::cat(blended).view({-1, 3, 4});
  return Apply(transform_of, torch::cat({points, torch::ones_like(points.narrow(1, 0, 1))}, 1));
}

torch::Tensor TransferErrors(const torch::Tensor& points, const RigBatch& predicted, const RigBatch& truth,
                             const std::vector<int64_t>& offsets) {
  const auto difference = DeformToNext(points, predicted, offsets) - DeformToNext(points, truth, offsets);
  constexpr double kTiny = 1e-8;  // keeps the gradient of the length finite
  return (difference.square().sum(1) + kTiny).sqrt();
}

}  // namespace stance
