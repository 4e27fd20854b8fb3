#include "core/training/motion_library.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/core/training/small_data.h"

namespace stance {
namespace {

std::vector<Rotation> Decoded(const MotionClip& clip, int frame) {
  std::vector<Rotation> local;
  for (int j = 0; j < kHumanJoints; ++j) {
    const int16_t* q = &clip.quaternions[(frame * kHumanJoints + j) * 4];
    local.push_back(Eigen::Quaternionf(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix());
  }
  return local;
}

int Find(const BvhClip& bvh, const std::string& name) {
  for (size_t j = 0; j < bvh.joints.size(); ++j) {
    if (bvh.joints[j].name == name) return static_cast<int>(j);
  }
  ADD_FAILURE() << name;
  return 0;
}

// The theorem of the retargeting: limbs point where the captured limbs point.
TEST(RetargetClip, BonesPointWhereTheCapturedBonesPoint) {
  const auto bvh = ParseBvh(testing::SmallMotion(3));
  ASSERT_TRUE(bvh.ok());
  const Points rest = testing::TPoseJoints();
  const auto clip = RetargetClip(*bvh, "clip", rest);
  ASSERT_TRUE(clip.ok()) << clip.status();
  ASSERT_EQ(clip->frame_count(), 5);  // the first of six frames is the zero pose
  const std::vector<std::pair<std::pair<int, int>, std::pair<std::string, std::string>>> bones = {
      {{kLeftHip, kLeftKnee}, {"lThigh", "lShin"}},
      {{kRightHip, kRightKnee}, {"rThigh", "rShin"}},
      {{kLeftKnee, kLeftAnkle}, {"lShin", "lFoot"}},
      {{kRightKnee, kRightAnkle}, {"rShin", "rFoot"}},
      {{kLeftShoulder, kLeftElbow}, {"lShldr", "lForeArm"}},
      {{kRightShoulder, kRightElbow}, {"rShldr", "rForeArm"}},
      {{kLeftElbow, kLeftWrist}, {"lForeArm", "lHand"}},
      {{kRightElbow, kRightWrist}, {"rForeArm", "rHand"}},
      {{kLeftWrist, kLeftHand}, {"lHand", "lMid1"}},
      {{kRightWrist, kRightHand}, {"rHand", "rMid1"}}};
  for (int frame = 0; frame < 5; ++frame) {
    const BvhPose captured = PoseOfFrame(*bvh, frame + 1);
    const std::vector<Rotation> global = GlobalRotations(HumanSkeleton(), Decoded(*clip, frame));
    EXPECT_TRUE(global[kPelvis].isApprox(captured.rotations[0], 2e-3f));
    EXPECT_TRUE(global[kSpine3].isApprox(captured.rotations[Find(*bvh, "chest")], 2e-3f));
    EXPECT_TRUE(global[kHead].isApprox(captured.rotations[Find(*bvh, "head")], 2e-3f));
    for (const auto& [ours, theirs] : bones) {
      const Eigen::Vector3f bone =
          global[ours.first] * (rest.row(ours.second) - rest.row(ours.first)).transpose();
      const Eigen::Vector3f truth = (captured.positions.row(Find(*bvh, theirs.second)) -
                                     captured.positions.row(Find(*bvh, theirs.first)))
                                        .transpose();
      EXPECT_LT((bone.normalized() - truth.normalized()).norm(), 2e-3f) << theirs.first << " frame " << frame;
    }
  }
}

TEST(RetargetClip, RejectsAnotherSkeleton) {
  std::string text = testing::SmallMotion(3);
  for (size_t at; (at = text.find("lShin")) != std::string::npos;) text.replace(at, 5, "lCalf");
  const auto bvh = ParseBvh(text);
  ASSERT_TRUE(bvh.ok());
  const auto clip = RetargetClip(*bvh, "walk", testing::TPoseJoints());
  EXPECT_EQ(clip.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(clip.status().message()).find("lShin"), std::string::npos);
}

TEST(MotionLibrary, SplitsHoldAboutTheirShareOfTheClips) {
  int counts[3] = {};
  for (int i = 0; i < 2000; ++i)
    ++counts[static_cast<int>(MotionLibrary::SplitOfClip(fmt::format("{:02}_{:02}", i / 40, i % 40)))];
  EXPECT_NEAR(counts[0], 1600, 80);
  EXPECT_NEAR(counts[1], 200, 60);
  EXPECT_NEAR(counts[2], 200, 60);
}

MotionLibrary SmallLibrary() {
  std::vector<MotionClip> clips;
  for (int i = 0; i < 60; ++i) {
    clips.push_back(
        *RetargetClip(*ParseBvh(testing::SmallMotion(i)), fmt::format("clip_{}", i), testing::TPoseJoints()));
  }
  return MotionLibrary(std::move(clips));
}

TEST(MotionLibrary, SplitsShareNoPose) {
  const MotionLibrary library = SmallLibrary();
  std::vector<std::set<std::vector<float>>> seen(3);
  Random random(1);
  for (const Split split : {Split::kTrain, Split::kValidation, Split::kTest}) {
    for (int i = 0; i < 200; ++i) {
      const auto pose = library.Sample(random, split);
      ASSERT_TRUE(pose.has_value());
      const Rotation& knee = (*pose)[kLeftKnee];
      seen[static_cast<int>(split)].insert(std::vector<float>(knee.data(), knee.data() + 9));
    }
  }
  for (int a = 0; a < 3; ++a) {
    EXPECT_GT(seen[a].size(), 10u);
    for (int b = 0; b < a; ++b) {
      for (const auto& pose : seen[b]) EXPECT_EQ(seen[a].count(pose), 0u);
    }
  }
}

TEST(MotionLibrary, SampledPosesFaceForward) {
  const MotionLibrary library = SmallLibrary();
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const auto pose = library.Sample(random, Split::kTrain);
    ASSERT_TRUE(pose.has_value());
    EXPECT_NEAR((*pose)[kPelvis](0, 2), 0, 1e-4);
    EXPECT_GT((*pose)[kPelvis](2, 2), 0);
    for (const Rotation& rotation : *pose) {
      EXPECT_TRUE((rotation * rotation.transpose()).isIdentity(1e-4f));
      EXPECT_NEAR(rotation.determinant(), 1, 1e-4);
    }
  }
}

TEST(MotionLibrary, EmptySplitGivesNothing) {
  Random random(1);
  EXPECT_FALSE(MotionLibrary({}).Sample(random, Split::kTest).has_value());
}

TEST(ReadMotions, ReadsAFolderInOrder) {
  const testing::TemporaryFolder folder;
  testing::WriteSmallMotions(folder.path(), 3);
  const auto clips = ReadMotions(folder.path(), testing::TPoseJoints());
  ASSERT_TRUE(clips.ok()) << clips.status();
  ASSERT_EQ(clips->size(), 3u);
  EXPECT_EQ((*clips)[1].name, "clip_01");
}

TEST(ReadMotions, MissingAndEmptyFoldersAreNotFound) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(ReadMotions(folder.path(), testing::TPoseJoints()).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadMotions(folder.path() / "none", testing::TPoseJoints()).status().code(),
            absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace stance
