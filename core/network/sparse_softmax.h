// Skinning weights from confidences (paper B, equations 5 and 6). Includes Torch.
#pragma once

#include <torch/torch.h>

namespace stance {

// Joints that a vertex may follow (paper B, section 3.1.1).
inline constexpr int64_t kSparseInfluences = 4;

// W_ij = s_ij exp(A_ij) / (sum_j s_ij exp(A_ij) + 1e-10), s_ij = 1 where A_ij >= q_i, the k-th largest of row
// i, else 0. A (N, C) -> W (N, C).
//
// The row's largest entry is subtracted first, which changes nothing but the constant's share: rows sum to 1
// however small their entries. Entries that equal q_i all stay, so that ties, and the order of the columns,
// decide nothing. Rows of k or fewer entries above minus infinity are their plain softmax; a row of nothing
// else is zero, one with a NaN is NaN. Differentiable where no two entries tie at q_i: the gradient is the
// softmax's on the entries that stay, zero on the others. REQUIRES: k >= 1.
torch::Tensor SparseSoftmax(const torch::Tensor& logits, int64_t k = kSparseInfluences);

}  // namespace stance
