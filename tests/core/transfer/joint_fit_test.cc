#include "core/transfer/joint_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace stance {
namespace {

constexpr float kStiffness = 0.5f;

// A random skeleton in a random pose, all parts true.
FoundSkeleton TrueSkeleton() {
  std::srand(11);
  const Skeleton& skeleton = HumanSkeleton();
  FoundSkeleton found;
  found.bones = 0.2f * Points::Random(kHumanJoints, 3);
  found.bones.row(kPelvis).setZero();
  found.joints = Points::Zero(kHumanJoints, 3);
  found.joints.row(kPelvis) << 0.1f, 0.9f, -0.3f;
  for (int j = 0; j < kHumanJoints; ++j) {
    found.rotations.emplace_back(Eigen::Quaternionf::UnitRandom().toRotationMatrix());
    if (j == kPelvis) continue;
    const int p = skeleton.parents()[j];
    found.joints.row(j) = found.joints.row(p) + found.bones.row(j) * found.rotations[p].transpose();
  }
  found.confidence = 0.5f * (Eigen::VectorXf::Ones(kHumanJoints) + Eigen::VectorXf::Random(kHumanJoints));
  return found;
}

float LargestDifference(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

TEST(FitJoints, LeavesJointsThatAgreeWithTheirBones) {
  const FoundSkeleton found = TrueSkeleton();
  EXPECT_LT(LargestDifference(FitJoints(HumanSkeleton(), found, kStiffness), found.joints), 1e-5f);
}

TEST(FitJoints, WithoutStiffnessLeavesAnyJoints) {
  FoundSkeleton found = TrueSkeleton();
  found.joints += 0.1f * Points::Random(kHumanJoints, 3);
  EXPECT_LT(LargestDifference(FitJoints(HumanSkeleton(), found, 0), found.joints), 1e-6f);
}

TEST(FitJoints, HalvesTheErrorOfIndependentMistakes) {
  const FoundSkeleton truth = TrueSkeleton();
  FoundSkeleton found = truth;
  found.confidence.setOnes();
  found.joints += 0.02f * Points::Random(kHumanJoints, 3);
  const auto square = [&truth](const Points& joints) { return (joints - truth.joints).squaredNorm(); };
  EXPECT_LT(square(FitJoints(HumanSkeleton(), found, 2)), 0.5f * square(found.joints));
}

TEST(FitJoints, KeepsTheMeanOfTheJoints) {
  FoundSkeleton found = TrueSkeleton();
  found.joints += 0.1f * Points::Random(kHumanJoints, 3);
  const Points fit = FitJoints(HumanSkeleton(), found, kStiffness);
  EXPECT_LT((fit.colwise().mean() - found.joints.colwise().mean()).norm(), 1e-5f);
}

TEST(FitJoints, MovesWithTheBody) {
  FoundSkeleton found = TrueSkeleton();
  found.joints += 0.1f * Points::Random(kHumanJoints, 3);
  const Points fit = FitJoints(HumanSkeleton(), found, kStiffness);
  const Rotation turn = Eigen::Quaternionf::UnitRandom().toRotationMatrix();
  const Eigen::RowVector3f shift(0.3f, -2, 1);
  found.joints = ((found.joints * turn.transpose()).rowwise() + shift).eval();
  for (Rotation& rotation : found.rotations) rotation = turn * rotation;
  const Points expected = (fit * turn.transpose()).rowwise() + shift;
  EXPECT_LT(LargestDifference(FitJoints(HumanSkeleton(), found, kStiffness), expected), 1e-5f);
}

TEST(FitJoints, ABoneOfAJointWithoutConfidenceSaysNothing) {
  FoundSkeleton found = TrueSkeleton();
  found.confidence.setOnes();
  found.confidence[kLeftHand] = 0;
  found.joints.row(kLeftHand) << 5, 5, 5;
  const Points fit = FitJoints(HumanSkeleton(), found, kStiffness);
  EXPECT_LT((fit - found.joints).topRows(kHumanJoints - 2).rowwise().norm().maxCoeff(), 1e-5f);
  EXPECT_LT((fit.row(kLeftHand) - found.joints.row(kLeftHand)).norm(), 1e-5f);
}

}  // namespace
}  // namespace stance
