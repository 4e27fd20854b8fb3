#include "core/transfer/skinned_glb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/mesh/io_bytes.h"
#include "core/mesh/io_glb_accessor.h"
#include "core/mesh/mesh_io.h"
#include "core/skeleton/bone_names.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

// A capsule whose vertices are bound to all 24 joints, nearer joints more.
struct Character {
  TriangleMesh mesh = testing::Capsule();
  Rig rig;

  Character() {
    rig.joints.resize(kHumanJoints, 3);
    rig.weights.resize(mesh.vertex_count(), kHumanJoints);
    for (int j = 0; j < kHumanJoints; ++j) {
      rig.joints.row(j) << 0.1f * std::sin(1.0f * j), 0.05f * j - 0.6f, 0.03f * std::cos(2.0f * j);
      for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
        rig.weights(v, j) = std::exp(-8.0f * (mesh.positions.row(v) - rig.joints.row(j)).norm());
      }
    }
    rig.weights.array().colwise() /= rig.weights.rowwise().sum().array().eval();
  }

  absl::StatusOr<std::string> Serialize(const std::vector<std::string>& names = {}) const {
    return SerializeSkinnedGlb(mesh, HumanSkeleton(), rig, names);
  }
  std::string Rejection(const std::vector<std::string>& names = {}) const {
    const absl::StatusOr<std::string> bytes = Serialize(names);
    EXPECT_EQ(bytes.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(bytes.status().message());
  }
};

// Element `row`, `component` of an accessor, read straight from the binary chunk.
float ReadFloat(const GlbChunks& glb, int accessor, int64_t row, int component, int components) {
  const Json& view = glb.root["bufferViews"][glb.root["accessors"][accessor]["bufferView"].get<int>()];
  return LoadLittleEndian<float>(glb.binary.data() + view["byteOffset"].get<size_t>() +
                                 4 * (row * components + component));
}

uint8_t ReadByte(const GlbChunks& glb, int accessor, int64_t row, int component) {
  const Json& view = glb.root["bufferViews"][glb.root["accessors"][accessor]["bufferView"].get<int>()];
  return static_cast<uint8_t>(glb.binary[view["byteOffset"].get<size_t>() + 4 * row + component]);
}

TEST(SkinnedGlb, TheMeshInItIsTheMesh) {
  const Character character;
  const absl::StatusOr<TriangleMesh> mesh = ParseMesh(character.Serialize().value(), MeshFormat::kGlb);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->positions, character.mesh.positions);
  EXPECT_EQ(mesh->faces, character.mesh.faces);
}

TEST(SkinnedGlb, ComputesOutwardNormalsOnlyWhereThereAreNone) {
  Character character;
  TriangleMesh mesh = ParseMesh(character.Serialize().value(), MeshFormat::kGlb).value();
  ASSERT_EQ(mesh.normals.rows(), mesh.vertex_count());
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    // The capsule's own normal: away from the nearest point of its axis.
    Eigen::RowVector3f axis(0, std::clamp(mesh.positions(v, 1), -0.5f, 0.5f), 0);
    EXPECT_GT(mesh.normals.row(v).dot((mesh.positions.row(v) - axis).normalized()), 0.95f);
  }
  character.mesh = testing::WithAttributes(character.mesh);
  mesh = ParseMesh(character.Serialize().value(), MeshFormat::kGlb).value();
  EXPECT_LT((mesh.normals - character.mesh.normals).cwiseAbs().maxCoeff(), 1e-6f);
}

TEST(SkinnedGlb, TheRestPoseLeavesEveryJointAndVertexInPlace) {
  const Character character;
  const std::string bytes = character.Serialize().value();
  const GlbChunks glb = SplitGlb(bytes).value();
  const Json& skin = glb.root["skins"][0];
  ASSERT_EQ(skin["joints"].size(), static_cast<size_t>(kHumanJoints));

  std::vector<int> parent(glb.root["nodes"].size(), -1);
  for (size_t n = 0; n < parent.size(); ++n) {
    for (const Json& child : glb.root["nodes"][n].value("children", Json::array()))
      parent[child.get<int>()] = n;
  }
  const int matrices = skin["inverseBindMatrices"];
  for (int j = 0; j < kHumanJoints; ++j) {
    const int node = skin["joints"][j];
    EXPECT_EQ(j == 0 ? -1 : skin["joints"][HumanSkeleton().parents()[j]].get<int>(), parent[node]);
    Eigen::RowVector3f global = Eigen::RowVector3f::Zero();
    for (int n = node; n >= 0; n = parent[n]) {
      const Json& json = glb.root["nodes"][n];
      EXPECT_FALSE(json.contains("rotation") || json.contains("scale") || json.contains("matrix"));
      const std::vector<float> t = json.value("translation", std::vector<float>{0, 0, 0});
      global += Eigen::RowVector3f(t[0], t[1], t[2]);
    }
    EXPECT_LT((global - character.rig.joints.row(j)).norm(), 1e-6f);
    // Joint transform times inverse bind matrix is the identity.
    for (int k = 0; k < 16; ++k) {
      const int row = k % 4, column = k / 4;
      const float expected = column == 3 && row < 3 ? -global[row] : row == column ? 1.0f : 0.0f;
      EXPECT_NEAR(ReadFloat(glb, matrices, j, k, 16), expected, 1e-6f);
    }
  }
}

TEST(SkinnedGlb, KeepsTheFourLargestWeightsAndMakesThemSumToOne) {
  const Character character;
  const std::string bytes = character.Serialize().value();
  const GlbChunks glb = SplitGlb(bytes).value();
  const Json& attributes = glb.root["meshes"][0]["primitives"][0]["attributes"];
  const int joints = attributes["JOINTS_0"], weights = attributes["WEIGHTS_0"];
  EXPECT_EQ(glb.root["accessors"][joints]["componentType"], 5121);
  EXPECT_EQ(glb.root["accessors"][weights]["componentType"], 5126);
  for (int64_t v = 0; v < character.mesh.vertex_count(); ++v) {
    float sum = 0, kept = 0, least = 1;
    for (int k = 0; k < 4; ++k) {
      sum += ReadFloat(glb, weights, v, k, 4);
      const float original = character.rig.weights(v, ReadByte(glb, joints, v, k));
      kept += original;
      least = std::min(least, original);
    }
    EXPECT_NEAR(sum, 1.0f, 3e-7f);
    EXPECT_EQ((character.rig.weights.row(v).array() > least).count(), 3);
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(ReadFloat(glb, weights, v, k, 4),
                  character.rig.weights(v, ReadByte(glb, joints, v, k)) / kept, 1e-6f);
    }
  }
}

TEST(SkinnedGlb, ARigidVertexHasOneJoint) {
  Character character;
  character.rig.weights.setZero();
  character.rig.weights.col(7).setOnes();
  const std::string bytes = character.Serialize().value();
  const GlbChunks glb = SplitGlb(bytes).value();
  const Json& attributes = glb.root["meshes"][0]["primitives"][0]["attributes"];
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(ReadFloat(glb, attributes["WEIGHTS_0"], 0, k, 4), k == 0 ? 1.0f : 0.0f);
    EXPECT_EQ(ReadByte(glb, attributes["JOINTS_0"], 0, k), k == 0 ? 7 : 0);
  }
}

TEST(SkinnedGlb, TheSkinnedNodeIsARootOfTheScene) {
  const std::string bytes = Character().Serialize().value();
  const GlbChunks glb = SplitGlb(bytes).value();
  int skinned = 0;
  for (const Json& n : glb.root["scenes"][0]["nodes"]) {
    const Json& node = glb.root["nodes"][n.get<int>()];
    if (!node.contains("skin")) continue;
    ++skinned;
    EXPECT_TRUE(node.contains("mesh"));
    EXPECT_FALSE(node.contains("translation"));
  }
  EXPECT_EQ(skinned, 1);
}

TEST(SkinnedGlb, JointsCarryTheGivenNames) {
  const Character character;
  for (const BoneNaming naming : {BoneNaming::kSmpl, BoneNaming::kMixamo}) {
    const std::string bytes = character.Serialize(HumanBoneNames(naming)).value();
    const GlbChunks glb = SplitGlb(bytes).value();
    for (int j = 0; j < kHumanJoints; ++j) {
      const int node = glb.root["skins"][0]["joints"][j];
      EXPECT_EQ(glb.root["nodes"][node]["name"], HumanBoneNames(naming)[j]);
    }
  }
  EXPECT_EQ(character.Serialize().value(), character.Serialize(HumanBoneNames(BoneNaming::kSmpl)).value());
}

TEST(SkinnedGlb, EveryGroupIsSkinned) {
  Character character;
  character.mesh = testing::WithAttributes(character.mesh);
  const std::string bytes = character.Serialize().value();
  const GlbChunks glb = SplitGlb(bytes).value();
  const Json& primitives = glb.root["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2u);
  for (const Json& primitive : primitives) {
    EXPECT_TRUE(primitive["attributes"].contains("JOINTS_0") &&
                primitive["attributes"].contains("WEIGHTS_0"));
  }
}

TEST(SkinnedGlb, RefusesWhatDoesNotFitTogether) {
  Character character;
  character.rig.joints.conservativeResize(23, 3);
  EXPECT_THAT(character.Rejection(), HasSubstr("23 joint positions for 24 joints"));
  character = Character();
  character.rig.joints(4, 2) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(character.Rejection(), HasSubstr("joint 4 has a non-finite coordinate"));
  character = Character();
  character.rig.weights.conservativeResize(5, kHumanJoints);
  EXPECT_THAT(character.Rejection(), HasSubstr("5 x 24 weights"));
  character = Character();
  character.rig.weights(3, 1) = -0.1f;
  EXPECT_THAT(character.Rejection(), HasSubstr("the weights of vertex 3 are negative"));
  character = Character();
  character.rig.weights.row(6).setZero();
  EXPECT_THAT(character.Rejection(), HasSubstr("the weights of vertex 6 are"));
  character = Character();
  EXPECT_THAT(character.Rejection({"pelvis"}), HasSubstr("1 names for 24 joints"));
  character.mesh.positions(2, 0) = std::numeric_limits<float>::infinity();
  EXPECT_THAT(character.Rejection(), HasSubstr("vertex 2 has a non-finite coordinate"));
}

TEST(SkinnedGlb, RefusesMoreJointsThanAByteNames) {
  std::vector<int> parents(256);
  for (int j = 0; j < 256; ++j) parents[j] = j - 1;
  const Skeleton chain(std::vector<std::string>(256, "joint"), parents);
  const TriangleMesh box = testing::Box();
  const Rig rig = {Points::Zero(256, 3), RowMatrix::Ones(8, 256)};
  EXPECT_EQ(SerializeSkinnedGlb(box, chain, rig).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace stance
