// What a batch's predicted rigs are for: how far each character lands from its true place when it takes the
// next one's pose. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <vector>

namespace stance {

// B characters, in one unit of length.
struct RigBatch {
  torch::Tensor weights;    // (N, 24) rows sum to 1
  torch::Tensor joints;     // (B, 24, 3)
  torch::Tensor rotations;  // (B, 24, 3, 3) global, from the rest pose
};

// The rotations (B, 24, 3, 3) as METHOD_STANCE's pose solver corrects them at joints with one child
// (transfer/learned_rotation_solver.h): turned by the smallest rotation that brings the child's bone at rest
// (B, 24, 3), so far as `correction` in [0, 1] says, onto the bone between the joints (B, 24, 3) as they are.
// The fraction is one of the chord, not of the angle. Differentiable in all.
torch::Tensor CorrectedByBones(const torch::Tensor& rotations, const torch::Tensor& joints,
                               const torch::Tensor& bones, double correction);

// Linear blend skinning (paper A, equations 8 to 10) of points (N, 3) into the next character's pose, that of
// the last into the first's: each joint turns by G = R_next R^T, the root stays in its place and the other
// joints on their parents' bones. `offsets` are the B + 1 first rows of the characters. -> (N, 3),
// differentiable in all of `rigs`.
torch::Tensor DeformToNext(const torch::Tensor& points, const RigBatch& rigs,
                           const std::vector<int64_t>& offsets);

// The distance (N) between where `predicted` and where `truth` bring each point.
torch::Tensor TransferErrors(const torch::Tensor& points, const RigBatch& predicted, const RigBatch& truth,
                             const std::vector<int64_t>& offsets);

}  // namespace stance
