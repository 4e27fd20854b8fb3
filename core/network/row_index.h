// Exact nearest neighbours among the rows of a matrix. Free of Torch.
#pragma once

#include <cstdint>
#include <vector>

namespace stance {

// Answers "which k rows lie nearest to each row" for features over a surface: many channels, few dimensions
// that matter. Rows are ordered by a kd-tree in a screen of at most 8 coordinates whose distances never
// exceed the true ones: the rows' projections onto the leading principal directions, and the length of what
// the projection leaves out (|p - q|^2 >= |Pp - Pq|^2 + (|p - Pp| - |q - Pq|)^2). Whole leaves of 16 rows are
// ruled out by their boxes, rows by the screen, and the true distance, a sum over all channels, decides the
// rest.
class RowIndex {
 public:
  // x: (rows, channels), row-major; copied. A row that is not finite is nobody's neighbour but its own.
  RowIndex(const float* x, int64_t rows, int64_t channels);

  int64_t leaf_count() const { return static_cast<int64_t>(leaf_begin_.size()) - 1; }

  // For each row of leaves [first, last) writes its k nearest rows plus `offset`, itself included, nearest
  // first, to out[row * k ...]; where there are fewer than k rows, the row itself fills the rest.
  // REQUIRES: k >= 1. Different leaves may be asked for by different threads.
  void Nearest(int64_t first, int64_t last, int k, int32_t offset, int32_t* out) const;

 private:
  static constexpr int kLeaf = 16;
  static constexpr int kScreen = 8;

  void Order(const float* screen, int dimensions);

  int64_t rows_, width_;             // channels padded to a multiple of 8
  std::vector<float> x_;             // (rows, width), in leaf order
  std::vector<float> blocks_;        // (leaves, kScreen, kLeaf): the screen, padded with huge values
  std::vector<float> low_, high_;    // (kScreen, leaves): the leaves' boxes
  std::vector<int32_t> original_;    // leaf order -> row
  std::vector<int64_t> leaf_begin_;  // (leaves + 1)
  int dimensions_ = 0;               // of the screen
  float slack_ = 0;                  // what rounding may add to a screened squared distance
};

}  // namespace stance
