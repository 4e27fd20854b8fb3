#include "core/training/bvh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <string>

#include "core/base/random.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

// Two bones of length 2 and 1 along y; channel orders differ.
constexpr char kArm[] = R"(HIERARCHY
ROOT base
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT upper
  {
    OFFSET 0 2 0
    CHANNELS 3 Xrotation Yrotation Zrotation
    JOINT lower
    {
      OFFSET 0 1 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 .5 0
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.1
0 0 0 0 0 0 0 0 0 0 0 0
10 20 30 90 0 0 0 90 90 0 0 0
)";

std::string Replaced(const std::string& from, const std::string& to) {
  std::string text = kArm;
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

void ExpectRejected(const std::string& text, const std::string& fragment) {
  const auto clip = ParseBvh(text);
  ASSERT_EQ(clip.status().code(), absl::StatusCode::kInvalidArgument) << text;
  EXPECT_NE(std::string(clip.status().message()).find(fragment), std::string::npos) << clip.status();
}

TEST(Bvh, ReadsTheHierarchy) {
  const auto clip = ParseBvh(kArm);
  ASSERT_TRUE(clip.ok()) << clip.status();
  ASSERT_EQ(clip->joints.size(), 3u);
  EXPECT_EQ(clip->joints[1].name, "upper");
  EXPECT_EQ(clip->joints[0].parent, -1);
  EXPECT_EQ(clip->joints[1].parent, 0);
  EXPECT_EQ(clip->joints[2].parent, 1);
  EXPECT_EQ(clip->joints[2].first_channel, 9);
  EXPECT_EQ(clip->frames.rows(), 2);
  EXPECT_EQ(clip->frames.cols(), 12);
  EXPECT_DOUBLE_EQ(clip->frame_time, 0.1);
}

TEST(Bvh, ZeroAnglesGiveTheOffsets) {
  const auto clip = ParseBvh(kArm);
  ASSERT_TRUE(clip.ok());
  const BvhPose pose = PoseOfFrame(*clip, 0);
  EXPECT_TRUE(pose.positions.row(2).isApprox(Eigen::RowVector3f(0, 3, 0)));
  for (const Rotation& rotation : pose.rotations) EXPECT_TRUE(rotation.isIdentity(1e-6f));
}

// Root: a quarter turn about z sends y to -x. Upper: Ry(90) Rz(90) sends y to Ry(90)(-x) = +z, which the root
// leaves; the lower bone therefore points to +z.
TEST(Bvh, FollowsTheChannelOrderByHand) {
  const auto clip = ParseBvh(kArm);
  ASSERT_TRUE(clip.ok());
  const BvhPose pose = PoseOfFrame(*clip, 1);
  EXPECT_TRUE(pose.positions.row(0).isApprox(Eigen::RowVector3f(10, 20, 30), 1e-5f));
  EXPECT_TRUE(pose.positions.row(1).isApprox(Eigen::RowVector3f(8, 20, 30), 1e-5f)) << pose.positions.row(1);
  EXPECT_TRUE(pose.positions.row(2).isApprox(Eigen::RowVector3f(8, 20, 31), 1e-5f)) << pose.positions.row(2);
}

TEST(Bvh, RejectsMalformedFilesByLine) {
  ExpectRejected("", "HIERARCHY");
  ExpectRejected(Replaced("ROOT", "LEAF"), "line 2");
  ExpectRejected(Replaced("OFFSET 0 2 0", "OFFSET 0 two 0"), "line 8");
  ExpectRejected(Replaced("OFFSET 0 2 0", "OFFSET 0 nan 0"), "a number");
  ExpectRejected(Replaced("CHANNELS 3 X", "CHANNELS 9 X"), "0 to 6 channels");
  ExpectRejected(Replaced("CHANNELS 3 X", "CHANNELS 3 W"), "a channel's name");
  ExpectRejected(Replaced("End Site", "End Point"), "Site");
  ExpectRejected(Replaced("Frames: 2", "Frames: 3"), "a number");
  ExpectRejected(Replaced("Frames: 2", "Frames: -2"), "frames");
  ExpectRejected(Replaced("Frames: 2", "Frames: 99999999999"), "frames");
  ExpectRejected(std::string(kArm) + "7", "the end");
}

TEST(Bvh, RejectsEveryTruncation) {
  const std::string text = kArm;
  const size_t last_number = text.find_last_of('0');
  for (size_t size = 0; size < last_number; ++size) EXPECT_FALSE(ParseBvh(text.substr(0, size)).ok()) << size;
}

TEST(Bvh, SurvivesDamagedBytes) {
  const std::string text = testing::SmallMotion(1);
  Random random(1);
  for (int round = 0; round < 300; ++round) {
    std::string damaged = text;
    for (int i = 0; i < 8; ++i) damaged[random.Below(damaged.size())] = static_cast<char>(random.Below(256));
    const auto clip = ParseBvh(damaged);
    if (!clip.ok()) {
      EXPECT_EQ(clip.status().code(), absl::StatusCode::kInvalidArgument);
    } else if (clip->frames.rows() > 0) {
      EXPECT_EQ(PoseOfFrame(*clip, 0).rotations.size(), clip->joints.size());
    }
  }
}

}  // namespace
}  // namespace stance
