#include "core/training/rigged_bones.h"

#include <gtest/gtest.h>

#include <string>

#include "core/skeleton/bone_names.h"
#include "tests/core/training/small_rig.h"

namespace stance {
namespace {

TEST(MapBones, KnowsEveryNamingOfBoneNames) {
  for (const BoneNaming naming :
       {BoneNaming::kSmpl, BoneNaming::kMixamo, BoneNaming::kVrm, BoneNaming::kUnreal}) {
    std::vector<FileBone> bones(kHumanJoints);
    for (int j = 0; j < kHumanJoints; ++j) {
      bones[j] = {HumanBoneNames(naming)[j], HumanSkeleton().parents()[j]};
    }
    const auto map = MapBones(bones);
    ASSERT_TRUE(map.ok()) << map.status();
    for (int j = 0; j < kHumanJoints; ++j) {
      EXPECT_EQ(map->joint_of_bone[j], j);
      EXPECT_EQ(map->bone_of_joint[j], j);
    }
  }
}

TEST(MapBones, OtherBonesGoWhereMpfbsDo) {
  const auto map = MapBones(testing::SmallRig().bones);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->joint_of_bone[24], kPelvis);     // root
  EXPECT_EQ(map->joint_of_bone[25], kHead);       // jaw
  EXPECT_EQ(map->joint_of_bone[26], kLeftHand);   // index finger
  EXPECT_EQ(map->joint_of_bone[27], kLeftWrist);  // thumb
  EXPECT_EQ(map->joint_of_bone[28], kLeftWrist);  // its next bone
}

TEST(MapBones, AHandWithoutAMiddleFingerBeginsAtAnother) {
  std::vector<FileBone> bones = testing::SmallRig().bones;
  bones[kLeftHand].name = "extra";
  bones[kLeftHand].parent = kHead;
  const auto map = MapBones(bones);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->bone_of_joint[kLeftHand], 26);
  EXPECT_EQ(map->joint_of_bone[kLeftHand], kHead);
}

TEST(MapBones, ABipedMayHaveAnyNumber) {
  const std::vector<std::string> names = {"Pelvis", "L Thigh",    "R Thigh",    "Spine",      "L Calf",
                                          "R Calf", "Spine1",     "L Foot",     "R Foot",     "Spine2",
                                          "L Toe0", "R Toe0",     "Neck",       "L Clavicle", "R Clavicle",
                                          "Head",   "L UpperArm", "R UpperArm", "L Forearm",  "R Forearm",
                                          "L Hand", "R Hand",     "L Finger2",  "R Finger2"};
  for (const std::string prefix : {"Bip01 ", "Bip02 "}) {
    std::vector<FileBone> bones(kHumanJoints);
    for (int j = 0; j < kHumanJoints; ++j) bones[j] = {prefix + names[j], HumanSkeleton().parents()[j]};
    bones.push_back({prefix + "L Finger0", kLeftWrist});
    bones.push_back({prefix + "L Finger1", kLeftWrist});
    const auto map = MapBones(bones);
    ASSERT_TRUE(map.ok()) << map.status();
    for (int j = 0; j < kHumanJoints; ++j) EXPECT_EQ(map->joint_of_bone[j], j);
    EXPECT_EQ(map->joint_of_bone[24], kLeftWrist);
    EXPECT_EQ(map->joint_of_bone[25], kLeftHand);
  }
}

TEST(MapBones, AMissingBoneIsNamed) {
  std::vector<FileBone> bones = testing::SmallRig().bones;
  bones[kRightElbow].name = "elbow";
  const auto map = MapBones(bones);
  EXPECT_EQ(map.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(map.status().message()).find("lowerarm_r"), std::string::npos);
  EXPECT_EQ(MapBones({}).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace stance
