#include "core/network/knn.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

// Distances of the table's neighbours against the k smallest of the full matrix in double precision.
void ExpectNearest(const torch::Tensor& x, const torch::Tensor& table) {
  const auto d = torch::cdist(x.to(torch::kFloat64), x.to(torch::kFloat64));
  const int64_t k = table.size(1);
  const auto expected = std::get<0>(d.topk(k, 1, /*largest=*/false));
  const auto found = std::get<0>(d.gather(1, table.to(torch::kInt64)).sort(1));
  EXPECT_LT((found - expected).abs().max().item<double>(), 1e-4 * d.max().item<double>());
}

class KNearestIn : public ::testing::TestWithParam<int> {};

TEST_P(KNearestIn, FindsTheNearestOfScatteredRows) {
  torch::manual_seed(GetParam());
  const auto x = torch::randn({700, GetParam()});
  ExpectNearest(x, KNearest(x, {0, 700}, 20));
  ExpectNearest(x, KNearestByTorch(x, 20));
}

// A curved surface in feature space, far from the origin: what the layers of a network make.
TEST_P(KNearestIn, FindsTheNearestOnASurface) {
  torch::manual_seed(GetParam());
  const auto x = torch::tanh(torch::mm(torch::rand({2000, 2}), torch::randn({2, GetParam()}))) + 10;
  ExpectNearest(x, KNearest(x, {0, 2000}, 20));
}

INSTANTIATE_TEST_SUITE_P(Dimensions, KNearestIn, ::testing::Values(1, 3, 8, 9, 64, 128, 256));

TEST(KNearest, ContainsTheRowItselfFirst) {
  const auto x = torch::rand({300, 3});
  const auto table = KNearest(x, {0, 300}, 5);
  EXPECT_TRUE(table.select(1, 0).equal(torch::arange(300, torch::kInt32)));
}

TEST(KNearest, StaysWithinEachMeshOfABatch) {
  torch::manual_seed(1);
  const auto x = torch::rand({500, 3});
  const std::vector<int64_t> offsets = {0, 50, 300, 500};
  const auto table = KNearest(x, offsets, 20);
  for (size_t mesh = 0; mesh < 3; ++mesh) {
    const auto rows = table.slice(0, offsets[mesh], offsets[mesh + 1]);
    EXPECT_GE(rows.min().item<int>(), offsets[mesh]);
    EXPECT_LT(rows.max().item<int>(), offsets[mesh + 1]);
    const auto alone =
        KNearest(x.slice(0, offsets[mesh], offsets[mesh + 1]), {0, offsets[mesh + 1] - offsets[mesh]}, 20);
    EXPECT_TRUE((alone + offsets[mesh]).equal(rows));
  }
}

TEST(KNearest, PadsATinyMeshWithTheRowItself) {
  const auto table = KNearest(torch::rand({3, 3}), {0, 3}, 5);
  ASSERT_EQ(table.size(1), 5);
  for (int row = 0; row < 3; ++row) {
    EXPECT_EQ(table[row][3].item<int>(), row);
    EXPECT_EQ(table[row][4].item<int>(), row);
  }
}

TEST(KNearest, HandlesCoincidingPoints) {
  const auto table = KNearest(torch::zeros({40, 3}), {0, 40}, 20);
  EXPECT_GE(table.min().item<int>(), 0);
  EXPECT_LT(table.max().item<int>(), 40);
}

TEST(KNearest, ARowThatIsNotFiniteIsItsOwnOnlyNeighbor) {
  torch::manual_seed(1);
  auto x = torch::rand({100, 64});
  x[17].fill_(std::numeric_limits<float>::quiet_NaN());
  const auto table = KNearest(x, {0, 100}, 20);
  EXPECT_TRUE((table[17] == 17).all().item<bool>());
  EXPECT_EQ((table == 17).sum().item<int64_t>(), 20);
}

}  // namespace
}  // namespace stance
