#include "core/training/mpfb_body.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/skeleton/skeleton.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

TEST(MpfbBody, ReadsTheSmallBody) {
  const testing::TemporaryFolder folder;
  testing::WriteSmallBody(folder.path());
  const auto body = ReadMpfbBody(folder.path());
  ASSERT_TRUE(body.ok()) << body.status();
  EXPECT_EQ(body->vertex_count, testing::kSmallBodyVertices);
  // 2 genders x 3 ages x (3 ethnicities + 9 builds x (1 + 2 heights + 2 proportions)), one optional.
  EXPECT_EQ(body->macro_count, 2 * 3 * (3 + 9 * 5) + 1);
  EXPECT_EQ(body->morphs.size() - body->macro_count, 4u);  // two pairs; the face's are left out
  EXPECT_EQ(body->levels.size(), 2u);                      // the body has 1,800 vertices: itself and 1,500
  EXPECT_LT((body->points.middleRows(body->vertex_count, kHumanJoints) - testing::SmallBodyJoints()).norm(),
            1e-4f);
  EXPECT_TRUE(CheckBodyData(*body).ok());
}

TEST(MpfbBody, EachMissingFileIsNotFoundAndNamed) {
  const testing::TemporaryFolder folder;
  testing::WriteSmallBody(folder.path());
  for (const std::string file :
       {"3dobjs/base.obj", "rigs/standard/rig.mixamo.json", "rigs/standard/weights.mixamo.json",
        "targets/target.json", "targets/macrodetails/asian-female-old.target.gz",
        "targets/torso/narrow.target.gz"}) {
    const std::filesystem::path path = folder.path() / file, aside = folder.path() / "aside";
    std::filesystem::rename(path, aside);
    const auto body = ReadMpfbBody(folder.path());
    EXPECT_EQ(body.status().code(), absl::StatusCode::kNotFound) << file;
    EXPECT_NE(std::string(body.status().message()).find(path.filename().string()), std::string::npos);
    std::filesystem::rename(aside, path);
  }
}

TEST(MpfbBody, ADamagedTargetIsDataLoss) {
  const testing::TemporaryFolder folder;
  testing::WriteSmallBody(folder.path());
  const std::filesystem::path target =
      folder.path() / "targets" / "macrodetails" / "asian-male-old.target.gz";
  std::filesystem::resize_file(target, std::filesystem::file_size(target) / 2);
  EXPECT_EQ(ReadMpfbBody(folder.path()).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace stance
