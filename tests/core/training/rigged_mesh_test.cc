#include "core/training/rigged_mesh.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "core/base/files.h"
#include "core/mesh/mesh_io.h"
#include "core/skeleton/bone_names.h"
#include "core/skeleton/skeleton.h"
#include "tests/core/training/small_data.h"
#include "tests/core/training/small_rig.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

TEST(ReadRiggedMesh, ReadsWhatAGlbHolds) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "rig.glb";
  ASSERT_TRUE(WriteFile(path, testing::SmallRigGlb()).ok());
  const auto mesh = ReadRiggedMesh(path);
  if (absl::IsUnimplemented(mesh.status())) GTEST_SKIP() << mesh.status();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->bones.size(), static_cast<size_t>(kHumanJoints));
  const Points joints = testing::SmallBodyJoints();
  for (const FileBone& bone : mesh->bones) {
    const auto& names = HumanBoneNames(BoneNaming::kUnreal);
    const auto joint = static_cast<int>(std::find(names.begin(), names.end(), bone.name) - names.begin());
    ASSERT_LT(joint, kHumanJoints) << bone.name;
    EXPECT_LT((bone.head - joints.row(joint).transpose()).norm(), 1e-5f);
    const int parent = HumanSkeleton().parents()[joint];
    EXPECT_EQ(parent < 0 ? "" : names[parent], bone.parent < 0 ? "" : mesh->bones[bone.parent].name);
  }
  EXPECT_EQ(mesh->positions.rows(), kHumanJoints * testing::kBoxVertices);
  EXPECT_EQ(mesh->faces.rows(), kHumanJoints * 12);
  EXPECT_LT((mesh->weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-6f);
}

TEST(ReadRiggedMesh, UnfitFilesAreNamed) {
  const testing::TemporaryFolder folder;
  const auto status = [](const std::filesystem::path& path) { return ReadRiggedMesh(path).status(); };
  const auto missing = folder.path() / "none.fbx";
  if (absl::IsUnimplemented(status(missing))) GTEST_SKIP() << status(missing);
  EXPECT_EQ(status(missing).code(), absl::StatusCode::kNotFound);
  const auto damaged = folder.path() / "damaged.fbx";
  std::ofstream(damaged) << "Kaydara FBX Binary, but not really";
  const auto rigid = folder.path() / "rigid.glb";
  ASSERT_TRUE(WriteMesh(testing::Box(1, 1, 1), rigid).ok());
  for (const auto& path : {damaged, rigid}) {
    EXPECT_EQ(status(path).code(), absl::StatusCode::kInvalidArgument);
    EXPECT_NE(std::string(status(path).message()).find(path.filename().string()), std::string::npos);
  }
}

}  // namespace
}  // namespace stance
