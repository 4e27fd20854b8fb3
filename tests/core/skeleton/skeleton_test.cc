#include "core/skeleton/skeleton.h"

#include <gtest/gtest.h>

#include <set>

namespace stance {
namespace {

TEST(HumanSkeleton, IsATreeInWhichParentsComeFirst) {
  const Skeleton& skeleton = HumanSkeleton();
  ASSERT_EQ(skeleton.joint_count(), kHumanJoints);
  EXPECT_EQ(skeleton.parents()[0], -1);
  std::set<int> reached = {0};
  for (int j = 1; j < kHumanJoints; ++j) {
    EXPECT_TRUE(reached.contains(skeleton.parents()[j])) << j;
    reached.insert(j);
  }
}

TEST(HumanSkeleton, ChildrenAreTheInverseOfParents) {
  const Skeleton& skeleton = HumanSkeleton();
  int edges = 0;
  for (int j = 0; j < kHumanJoints; ++j) {
    for (const int child : skeleton.children(j)) EXPECT_EQ(skeleton.parents()[child], j);
    edges += static_cast<int>(skeleton.children(j).size());
    EXPECT_EQ(skeleton.is_leaf(j), skeleton.children(j).empty());
  }
  EXPECT_EQ(edges, kHumanJoints - 1);
}

TEST(HumanSkeleton, HasThreeChildrenAtPelvisAndChestAsPaperASays) {
  EXPECT_EQ(HumanSkeleton().children(kPelvis).size(), 3u);
  EXPECT_EQ(HumanSkeleton().children(kSpine3).size(), 3u);
  int leaves = 0;
  for (int j = 0; j < kHumanJoints; ++j) leaves += HumanSkeleton().is_leaf(j);
  EXPECT_EQ(leaves, 5);  // head, two feet, two hands
}

TEST(HumanSkeleton, NamesAreDistinct) {
  const auto& names = HumanSkeleton().names();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
}

TEST(MirrorJoint, IsAnInvolutionThatKeepsTheTree) {
  for (int j = 0; j < kHumanJoints; ++j) {
    EXPECT_EQ(MirrorJoint(MirrorJoint(j)), j);
    if (j > 0) {
      EXPECT_EQ(HumanSkeleton().parents()[MirrorJoint(j)], MirrorJoint(HumanSkeleton().parents()[j]));
    }
  }
  EXPECT_EQ(MirrorJoint(kLeftKnee), kRightKnee);
  EXPECT_EQ(MirrorJoint(kHead), kHead);
}

}  // namespace
}  // namespace stance
