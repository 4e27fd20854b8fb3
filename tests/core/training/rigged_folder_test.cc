#include "core/training/rigged_folder.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "core/base/files.h"
#include "core/skeleton/skeleton.h"
#include "core/training/mpfb_body.h"
#include "tests/core/training/small_data.h"
#include "tests/core/training/small_rig.h"

namespace stance {
namespace {

RestBody NeutralOf(const std::filesystem::path& mpfb) {
  auto body = ReadMpfbBody(mpfb);
  EXPECT_TRUE(body.ok()) << body.status();
  return BodyModel(std::make_shared<const BodyData>(*std::move(body))).Shape({}, 0);
}

RestBody SmallNeutral() {
  const testing::TemporaryFolder folder;
  testing::WriteSmallBody(folder.path());
  return NeutralOf(folder.path());
}

TEST(ReadRiggedFolder, HoldsOutOneInTenByName) {
  const testing::TemporaryFolder folder;
  const auto people = folder.path() / "people";
  std::filesystem::create_directory(people);
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(WriteFile(people / fmt::format("{:02}.glb", i), testing::SmallRigGlb()).ok());
  }
  std::ofstream(people / "02.glb") << "not a GLB";
  std::ofstream(people / "notes.txt") << "no character";
  const auto read = ReadRiggedFolder(people, SmallNeutral());
  if (absl::IsUnimplemented(read.status())) GTEST_SKIP() << read.status();
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->bodies.size(), 11u);
  ASSERT_EQ(read->refused.size(), 1u);
  EXPECT_NE(read->refused[0].find("02.glb"), std::string::npos);
  std::set<std::string> held_out;
  for (const RiggedBody& body : read->bodies) {
    if (body.held_out) held_out.insert(body.name);
  }
  EXPECT_EQ(held_out, std::set<std::string>{"people/04"});
}

TEST(ReadRiggedFolder, AFolderWithoutCharactersIsNotFound) {
  const testing::TemporaryFolder folder;
  for (const auto& path : {folder.path(), folder.path() / "none"}) {
    EXPECT_EQ(ReadRiggedFolder(path, {}).status().code(), absl::StatusCode::kNotFound);
  }
}

double Degrees(const Eigen::RowVector3f& a, const Eigen::RowVector3f& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 57.29578;
}

// The real files, where STANCE_MPFB_DIR and STANCE_RIGGED_DIR (a folder of folders) name them.
TEST(ReadRiggedFolder, RealCharactersRestAsTheNeutral) {
  const char* mpfb = std::getenv("STANCE_MPFB_DIR");
  const char* rigged = std::getenv("STANCE_RIGGED_DIR");
  if (mpfb == nullptr || rigged == nullptr) {
    GTEST_SKIP() << "STANCE_MPFB_DIR and STANCE_RIGGED_DIR don't name the data";
  }
  const RestBody neutral = NeutralOf(mpfb);
  std::set<std::string> names;
  for (const auto& folder : std::filesystem::directory_iterator(rigged)) {
    const auto read = ReadRiggedFolder(folder.path(), neutral);
    ASSERT_TRUE(read.ok()) << read.status();
    for (const std::string& line : read->refused) fmt::print("refused: {}\n", line);
    EXPECT_LE(read->refused.size(), 1u);
    for (const RiggedBody& body : read->bodies) {
      SCOPED_TRACE(body.name);
      EXPECT_TRUE(names.insert(body.name).second);
      EXPECT_TRUE(CheckRiggedBody(body).ok()) << CheckRiggedBody(body);
      const Points& joints = body.rest.joints;
      const auto bone = [](const Points& j, int joint) -> Eigen::RowVector3f {
        return j.row(HumanSkeleton().children(joint)[0]) - j.row(joint);
      };
      for (const int joint : {kLeftHip, kRightHip, kLeftKnee, kRightKnee, kLeftShoulder, kRightShoulder,
                              kLeftElbow, kRightElbow, kLeftWrist, kRightWrist}) {
        EXPECT_LT(Degrees(bone(joints, joint), bone(neutral.joints, joint)), 1) << joint;
      }
      for (const int joint : {kLeftAnkle, kRightAnkle}) {
        const auto heading = [&](const Points& j) {
          return Eigen::RowVector3f(bone(j, joint).cwiseProduct(Eigen::RowVector3f(1, 0, 1)));
        };
        EXPECT_LT(Degrees(heading(joints), heading(neutral.joints)), 1) << joint;
      }
      // No more than limbs need to bend: the trunk stays upright, toes point forward, left is left.
      EXPECT_LT(Degrees(joints.row(kNeck) - joints.row(kPelvis), Eigen::RowVector3f::UnitY()), 12);
      EXPECT_GT(joints(kLeftShoulder, 0), 0);
      EXPECT_GT(joints(kLeftFoot, 2), joints(kLeftAnkle, 2));
      // The left arm's surface is on the left.
      for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
        if (body.weights(v, kLeftElbow) > 0.9f) {
          EXPECT_GT(body.rest.positions(v, 0), 0) << v;
        }
      }
    }
  }
  EXPECT_GE(names.size(), 90u);
}

}  // namespace
}  // namespace stance
