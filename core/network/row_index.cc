#include "core/network/row_index.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/check.h"
#include "core/base/lanes.h"
#include "core/base/multiversion.h"

namespace stance {
namespace {

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kFar = 1e18f;  // the padding of a leaf: its square is finite, and larger than any distance

// Leading principal directions (channels, count), orthonormal, of rows taken evenly: any orthonormal basis
// bounds the distances, so a rough one will do.
Matrix PrincipalDirections(const Eigen::Map<const Matrix>& x, const Eigen::RowVectorXf& mean, int count) {
  constexpr int64_t kRows = 512;
  const int64_t step = std::max<int64_t>(1, x.rows() / kRows);
  Matrix some((x.rows() + step - 1) / step, x.cols());
  for (int64_t i = 0; i < some.rows(); ++i) some.row(i) = x.row(i * step) - mean;
  Matrix basis(x.cols(), count);
  for (int64_t i = 0; i < basis.size(); ++i) {  // any fixed start without symmetry
    basis.data()[i] = std::sin(1.0f + static_cast<float>(i) * 12.9898f);
  }
  for (int iteration = 0; iteration < 3; ++iteration) {
    const Matrix image = some.transpose() * (some * basis);
    if (!image.allFinite()) break;
    const Eigen::HouseholderQR<Eigen::MatrixXf> qr(image);
    basis = qr.householderQ() * Eigen::MatrixXf::Identity(x.cols(), count);
  }
  const Eigen::HouseholderQR<Eigen::MatrixXf> qr(basis);
  return qr.householderQ() * Eigen::MatrixXf::Identity(x.cols(), count);
}

[[gnu::always_inline]] inline float SquaredDistance(const float* a, const float* b, int64_t width) {
  Lanes sum = {};
  for (int64_t i = 0; i < width; i += 8) {
    const Lanes d = LanesAt(a + i) - LanesAt(b + i);
    sum += d * d;
  }
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

// Squared screen distances of one query to the 16 rows of a leaf.
[[gnu::always_inline]] inline void ScreenLeaf(const float* block, const float* query, int dimensions,
                                              float* out) {
  Lanes first = {}, second = {};
  for (int d = 0; d < dimensions; ++d) {
    const Lanes a = LanesAt(block + d * 16) - query[d], b = LanesAt(block + d * 16 + 8) - query[d];
    first += a * a;
    second += b * b;
  }
  LanesAt(out) = first;
  LanesAt(out + 8) = second;
}

// A list of one query's k nearest rows so far, ascending.
struct Nearest {
  const float* query;     // (width)
  const float* screened;  // (screen)
  float* distance;        // (k)
  int32_t* row;           // (k)
};

// Tries the `count` rows of a leaf on a list.
STANCE_MULTIVERSION void VisitLeaf(const float* block, int dimensions, float slack, const float* x,
                                   int64_t width, const int32_t* names, int64_t count, int k,
                                   const Nearest& nearest) {
  float screened[16];
  ScreenLeaf(block, nearest.screened, dimensions, screened);
  for (int64_t i = 0; i < count; ++i) {
    if (!(screened[i] <= nearest.distance[k - 1] + slack)) continue;
    const float distance = SquaredDistance(nearest.query, x + i * width, width);
    if (!(distance < nearest.distance[k - 1])) continue;
    int slot = k - 1;
    for (; slot > 0 && nearest.distance[slot - 1] > distance; --slot) {
      nearest.distance[slot] = nearest.distance[slot - 1];
      nearest.row[slot] = nearest.row[slot - 1];
    }
    nearest.distance[slot] = distance;
    nearest.row[slot] = names[i];
  }
}

// Squared distances of every leaf's box to one leaf's box.
STANCE_MULTIVERSION void BoxDistances(const float* low, const float* high, int64_t leaves, int dimensions,
                                      int64_t leaf, float* out) {
  std::fill(out, out + leaves, 0.0f);
  for (int d = 0; d < dimensions; ++d) {
    const float* lo = low + d * leaves;
    const float* hi = high + d * leaves;
    const float my_low = lo[leaf], my_high = hi[leaf];
    for (int64_t i = 0; i < leaves; ++i) {
      const float after = lo[i] - my_high, before = my_low - hi[i];
      float gap = after > before ? after : before;
      gap = gap > 0 ? gap : 0;
      out[i] += gap * gap;
    }
  }
}

}  // namespace

RowIndex::RowIndex(const float* x, int64_t rows, int64_t channels)
    : rows_(rows), width_((channels + 7) / 8 * 8), x_(rows * width_, 0.0f) {
  STANCE_CHECK(rows >= 1 && channels >= 1);
  const Eigen::Map<const Matrix> matrix(x, rows, channels);
  const int dimensions = static_cast<int>(std::min<int64_t>(channels, kScreen));
  Matrix screen = Matrix::Zero(rows, kScreen);  // row-major
  if (channels <= kScreen) {
    screen.leftCols(dimensions) = matrix;
  } else {
    const Eigen::RowVectorXf mean = matrix.colwise().mean();
    const Matrix basis = PrincipalDirections(matrix, mean, kScreen - 1);
    const Matrix centered = matrix.rowwise() - mean;
    screen.leftCols(kScreen - 1).noalias() = centered * basis;
    screen.col(kScreen - 1) = (centered - screen.leftCols(kScreen - 1) * basis.transpose()).rowwise().norm();
  }
  float largest = 0;
  for (int64_t row = 0; row < rows; ++row) {
    const float norm = screen.row(row).norm();
    if (norm < kFar / 10) {
      largest = std::max(largest, norm * norm);
    } else {
      screen.row(row).setConstant(kFar);  // not finite, or as good as
    }
  }
  slack_ = 4e-6f * largest;
  Order(screen.data(), dimensions);
  for (int64_t i = 0; i < rows; ++i) {
    std::copy_n(x + original_[i] * channels, channels, x_.begin() + i * width_);
  }
}

void RowIndex::Order(const float* screen, int dimensions) {
  const auto at = [&](int32_t row, int d) { return screen[row * kScreen + d]; };
  original_.resize(rows_);
  std::iota(original_.begin(), original_.end(), 0);
  // Halves along the widest side, all leaves full but the last.
  std::vector<std::pair<int64_t, int64_t>> parts = {{0, rows_}};
  while (!parts.empty()) {
    const auto [begin, end] = parts.back();
    parts.pop_back();
    if (end - begin <= kLeaf) {
      leaf_begin_.push_back(begin);
      continue;
    }
    int widest = 0;
    float width = -1;
    for (int d = 0; d < dimensions; ++d) {
      float low = kInfinity, high = -kInfinity;
      for (int64_t i = begin; i < end; ++i) {
        low = std::min(low, at(original_[i], d));
        high = std::max(high, at(original_[i], d));
      }
      if (high - low > width) {
        width = high - low;
        widest = d;
      }
    }
    const int64_t middle = begin + ((end - begin + 1) / 2 + kLeaf - 1) / kLeaf * kLeaf;
    std::nth_element(original_.begin() + begin, original_.begin() + middle, original_.begin() + end,
                     [&](int32_t a, int32_t b) {
                       const float x = at(a, widest), y = at(b, widest);
                       return x != y ? x < y : a < b;
                     });
    parts.emplace_back(middle, end);
    parts.emplace_back(begin, middle);
  }
  const auto leaves = static_cast<int64_t>(leaf_begin_.size());
  leaf_begin_.push_back(rows_);
  blocks_.assign(leaves * kScreen * kLeaf, kFar);
  low_.assign(kScreen * leaves, 0);
  high_.assign(kScreen * leaves, 0);
  for (int64_t leaf = 0; leaf < leaves; ++leaf) {
    for (int d = 0; d < dimensions; ++d) {
      float low = kInfinity, high = -kInfinity;
      for (int64_t i = leaf_begin_[leaf]; i < leaf_begin_[leaf + 1]; ++i) {
        const float value = at(original_[i], d);
        blocks_[(leaf * kScreen + d) * kLeaf + i - leaf_begin_[leaf]] = value;
        low = std::min(low, value);
        high = std::max(high, value);
      }
      low_[d * leaves + leaf] = low;
      high_[d * leaves + leaf] = high;
    }
  }
  dimensions_ = dimensions;
}

void RowIndex::Nearest(int64_t first, int64_t last, int k, int32_t offset, int32_t* out) const {
  STANCE_CHECK(k >= 1);
  const int64_t leaves = leaf_count();
  std::vector<float> box(leaves), best(kLeaf * k);
  std::vector<int32_t> index(kLeaf * k);
  std::vector<std::pair<float, int32_t>> near;
  for (int64_t leaf = first; leaf < last; ++leaf) {
    const int64_t begin = leaf_begin_[leaf], count = leaf_begin_[leaf + 1] - begin;
    BoxDistances(low_.data(), high_.data(), leaves, dimensions_, leaf, box.data());
    std::fill(best.begin(), best.end(), kInfinity);
    float screened_query[kLeaf][kScreen];
    for (int64_t i = 0; i < count; ++i) {
      std::fill_n(index.begin() + i * k, k, original_[begin + i]);
      for (int d = 0; d < kScreen; ++d) {
        screened_query[i][d] = blocks_[(leaf * kScreen + d) * kLeaf + i];
      }
    }
    const auto visit = [&](int64_t other, float bound) {
      for (int64_t i = 0; i < count; ++i) {
        if (bound > best[i * k + k - 1] + slack_) continue;
        VisitLeaf(
            blocks_.data() + other * kScreen * kLeaf, dimensions_, slack_,
            x_.data() + leaf_begin_[other] * width_, width_, original_.data() + leaf_begin_[other],
            leaf_begin_[other + 1] - leaf_begin_[other], k,
            {x_.data() + (begin + i) * width_, screened_query[i], best.data() + i * k, index.data() + i * k});
      }
    };
    // Itself and the next in order bound the distances; the rest comes nearest box first.
    const int64_t from = std::max<int64_t>(0, leaf - 1), to = std::min(leaves, leaf + 2);
    visit(leaf, 0);
    for (int64_t other = from; other < to; ++other) {
      if (other != leaf) visit(other, box[other]);
    }
    float reach = 0;
    for (int64_t i = 0; i < count; ++i) reach = std::max(reach, best[i * k + k - 1]);
    near.clear();
    for (int64_t other = 0; other < leaves; ++other) {
      if (box[other] <= reach + slack_ && (other < from || other >= to)) {
        near.emplace_back(box[other], static_cast<int32_t>(other));
      }
    }
    std::sort(near.begin(), near.end());
    for (const auto& [bound, other] : near) visit(other, bound);
    for (int64_t i = 0; i < count; ++i) {
      int32_t* row = out + static_cast<int64_t>(original_[begin + i]) * k;
      for (int j = 0; j < k; ++j) row[j] = index[i * k + j] + offset;
    }
  }
}

}  // namespace stance
