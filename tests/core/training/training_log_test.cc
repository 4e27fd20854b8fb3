#include "core/training/training_log.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/files.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

TEST(TrainingLog, RowsAppendedAreRowsRead) {
  const testing::TemporaryFolder folder;
  const auto csv = folder.path() / "log.csv";
  ASSERT_TRUE(AppendLog(csv, {8, 1.5, 2.25, 0.5, 30, 40, 50, 1e-3}).ok());
  ASSERT_TRUE(AppendLog(csv, {16, 3, 1.125, 0.75, 20, 25, 45, 5e-4}).ok());
  const auto rows = ReadLog(csv);
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_EQ(rows->size(), 2u);
  EXPECT_EQ((*rows)[0].loss, 2.25);
  EXPECT_EQ((*rows)[1].seen, 16);
  EXPECT_EQ((*rows)[1].degrees, 25);
  EXPECT_EQ((*rows)[1].transfer_mm, 45);
  EXPECT_EQ((*rows)[1].learning_rate, 5e-4);
}

TEST(TrainingLog, RowsFromBeforeRotationsOrTransfersWereLearnedAreRead) {
  const testing::TemporaryFolder folder;
  const auto csv = folder.path() / "log.csv";
  ASSERT_TRUE(WriteFile(csv,
                        "seen,seconds,loss,accuracy,joint_mm,learning_rate\n8,1.5,2.25,0.5,30,0.001\n"
                        "12,2,2,0.6,25,35,0.0007\n")
                  .ok());
  ASSERT_TRUE(AppendLog(csv, {16, 3, 1.125, 0.75, 20, 25, 45, 5e-4}).ok());
  const auto rows = ReadLog(csv);
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_EQ(rows->size(), 3u);
  EXPECT_EQ((*rows)[0].learning_rate, 0.001);
  EXPECT_EQ((*rows)[0].degrees, 0);
  EXPECT_EQ((*rows)[1].degrees, 35);
  EXPECT_EQ((*rows)[1].learning_rate, 0.0007);
  EXPECT_EQ((*rows)[2].degrees, 25);
  EXPECT_EQ((*rows)[2].transfer_mm, 45);
}

TEST(TrainingLog, AMalformedRowIsNamed) {
  const testing::TemporaryFolder folder;
  const auto csv = folder.path() / "log.csv";
  ASSERT_TRUE(
      WriteFile(csv, "seen,seconds,loss,accuracy,joint_mm,degrees,learning_rate\n1,2,3,4,5,6,7\n1,two,3\n")
          .ok());
  const auto status = ReadLog(csv).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(std::string(status.message()).find("row 3"), std::string::npos);
}

TEST(LossPlot, HasAPointPerRow) {
  const testing::TemporaryFolder folder;
  std::vector<LogRow> rows;
  for (int i = 1; i <= 5; ++i) rows.push_back({100.0 * i, 1.0 * i, 3.0 / i, 0, 0, 0, 0, 1e-3});
  const auto svg = folder.path() / "loss.svg";
  ASSERT_TRUE(WriteLossPlot(rows, "title", svg).ok());
  const std::string text = *ReadFile(svg);
  const std::string points = text.substr(text.find("points='") + 8);
  EXPECT_EQ(std::count(points.begin(), points.begin() + static_cast<int64_t>(points.find('\'')), ','), 5);
  EXPECT_NE(text.find("title"), std::string::npos);
}

}  // namespace
}  // namespace stance
