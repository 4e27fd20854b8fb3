#include "client/answers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/skeleton/skeleton.h"

namespace stance {
namespace {

using ::testing::ElementsAre;

TEST(NameBonesTest, NamesTheHumanSkeletonOnly) {
  JointTree human = {HumanSkeleton().names(), HumanSkeleton().parents()};
  NameBones(BoneNaming::kMixamo, &human);
  EXPECT_EQ(human.names, HumanBoneNames(BoneNaming::kMixamo));
  JointTree other = {{"root", "tip"}, {-1, 0}};
  NameBones(BoneNaming::kMixamo, &other);
  EXPECT_THAT(other.names, ElementsAre("root", "tip"));
}

}  // namespace
}  // namespace stance
