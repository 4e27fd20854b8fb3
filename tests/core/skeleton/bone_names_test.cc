#include "core/skeleton/bone_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "core/skeleton/skeleton.h"

namespace stance {
namespace {

using ::testing::HasSubstr;

constexpr BoneNaming kAllNamings[] = {BoneNaming::kSmpl, BoneNaming::kMixamo, BoneNaming::kVrm,
                                      BoneNaming::kUnreal};

TEST(BoneNames, EveryJointHasItsOwnName) {
  for (const BoneNaming naming : kAllNamings) {
    const std::vector<std::string>& names = HumanBoneNames(naming);
    ASSERT_EQ(names.size(), static_cast<size_t>(kHumanJoints));
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
    for (const std::string& name : names) EXPECT_FALSE(name.empty());
  }
}

TEST(BoneNames, SmplIsTheSkeletonsOwn) {
  EXPECT_EQ(HumanBoneNames(BoneNaming::kSmpl), HumanSkeleton().names());
}

TEST(BoneNames, MixamoNamesTheWholeBody) {
  const std::vector<std::string>& names = HumanBoneNames(BoneNaming::kMixamo);
  EXPECT_EQ(names[kPelvis], "mixamorig:Hips");
  EXPECT_EQ(names[kLeftHip], "mixamorig:LeftUpLeg");
  EXPECT_EQ(names[kSpine3], "mixamorig:Spine2");
  EXPECT_EQ(names[kRightElbow], "mixamorig:RightForeArm");
  EXPECT_EQ(names[kLeftHand], "mixamorig:LeftHandMiddle1");
  EXPECT_EQ(names[kRightHand], "mixamorig:RightHandMiddle1");
}

// The name with its side exchanged: Left and Right, left and right, _l and _r.
std::string OtherSide(std::string name) {
  for (const auto& [left, right] :
       {std::pair<std::string, std::string>{"Left", "Right"}, {"left", "right"}}) {
    if (const size_t at = name.find(left); at != std::string::npos)
      return name.replace(at, left.size(), right);
    if (const size_t at = name.find(right); at != std::string::npos)
      return name.replace(at, right.size(), left);
  }
  if (name.ends_with("_l")) return name.replace(name.size() - 1, 1, "r");
  if (name.ends_with("_r")) return name.replace(name.size() - 1, 1, "l");
  return name;
}

TEST(BoneNames, MirroredJointsHaveMirroredNames) {
  for (const BoneNaming naming : kAllNamings) {
    const std::vector<std::string>& names = HumanBoneNames(naming);
    for (int j = 0; j < kHumanJoints; ++j) EXPECT_EQ(OtherSide(names[j]), names[MirrorJoint(j)]);
  }
}

TEST(BoneNames, NamingsGoByTheirNames) {
  for (const BoneNaming naming : kAllNamings) {
    EXPECT_EQ(BoneNamingFromName(BoneNamingName(naming)).value(), naming);
  }
  for (const char* unknown : {"", "Mixamo", "maya"}) {
    const absl::Status status = BoneNamingFromName(unknown).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr("(smpl, mixamo, vrm, unreal)"));
  }
}

}  // namespace
}  // namespace stance
