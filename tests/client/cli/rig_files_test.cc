#include "client/cli/rig_files.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace stance {
namespace {

// Three joints, of which the middle one's name needs escapes, and four vertices.
RigAnswer SmallRig() {
  RigAnswer answer;
  answer.joints.names = {"root", "a \"b\"", "leaf"};
  answer.joints.parents = {-1, 0, 1};
  answer.result.rig.joints.resize(3, 3);
  answer.result.rig.joints << 0, 0.1f, 0, 1, 2, 3, -1e-7f, 1.0f / 3, 1e6f;
  answer.result.rig.weights.resize(4, 3);
  answer.result.rig.weights << 1, 0, 0, 0.25f, 0, 0.75f, 1.0f / 3, 1.0f / 3, 1.0f / 3, 0, 0.1f, 0.9f;
  return answer;
}

Points ReadPoints(const nlohmann::json& json) {
  Points points(json.size(), 3);
  for (size_t i = 0; i < json.size(); ++i) {
    for (int c = 0; c < 3; ++c) points(i, c) = json[i][c].get<float>();
  }
  return points;
}

RowMatrix ReadWeights(const nlohmann::json& json) {
  RowMatrix weights = RowMatrix::Zero(json["vertex_count"].get<int>(), json["joint_count"].get<int>());
  for (int v = 0; v < weights.rows(); ++v) {
    for (int e = json["row_offsets"][v].get<int>(); e < json["row_offsets"][v + 1].get<int>(); ++e) {
      weights(v, json["joint_indices"][e].get<int>()) = json["weights"][e].get<float>();
    }
  }
  return weights;
}

TEST(RigFilesTest, RigJsonReadsBackExactly) {
  const RigAnswer answer = SmallRig();
  const auto json = nlohmann::json::parse(RigJson(answer));
  EXPECT_EQ(json["format"], "stance-rig-1");
  EXPECT_EQ(json["names"], answer.joints.names);
  EXPECT_EQ(json["parents"], answer.joints.parents);
  EXPECT_EQ(ReadPoints(json["joints"]), answer.result.rig.joints);
  EXPECT_EQ(ReadWeights(json), answer.result.rig.weights);
}

TEST(RigFilesTest, ConfidencesStandInBothFilesWhereTheyAreKnown) {
  RigAnswer rig = SmallRig();
  EXPECT_FALSE(nlohmann::json::parse(RigJson(rig)).contains("confidence"));
  rig.result.rig.confidence = Eigen::VectorXf{{0.125f, 1.0f / 3, 1.0f}};
  const auto read = nlohmann::json::parse(RigJson(rig))["confidence"].get<std::vector<float>>();
  EXPECT_EQ(read, (std::vector<float>{0.125f, 1.0f / 3, 1}));
  TransferAnswer answer;
  answer.joints = rig.joints;
  answer.result.source_rig = answer.result.reference_rig = rig.result.rig;
  answer.result.target_joints = rig.result.rig.joints;
  answer.result.transforms.resize(3);
  const auto json = nlohmann::json::parse(SkeletonJson(answer));
  EXPECT_EQ(json["confidence"]["source"].get<std::vector<float>>(), read);
  EXPECT_EQ(json["confidence"]["reference"].get<std::vector<float>>(), read);
  answer.result.source_rig.confidence.resize(0);
  EXPECT_FALSE(nlohmann::json::parse(SkeletonJson(answer)).contains("confidence"));
}

TEST(RigFilesTest, WeightsJsonReadsBackExactlyHeaviestFirst) {
  const RigAnswer answer = SmallRig();
  const auto json = nlohmann::json::parse(WeightsJson(answer.joints, answer.result.rig.weights));
  EXPECT_EQ(ReadWeights(json), answer.result.rig.weights);
  EXPECT_EQ(json["row_offsets"], nlohmann::json({0, 1, 3, 6, 8}));
  EXPECT_EQ(json["joint_indices"], nlohmann::json({0, 2, 0, 0, 1, 2, 2, 1}));
}

TEST(RigFilesTest, WeightsCsvHasOneLinePerPositiveEntry) {
  RigAnswer answer = SmallRig();
  answer.joints.names[1] = "middle";
  EXPECT_EQ(WeightsCsv(answer.joints, answer.result.rig.weights.topRows(2)),
            "vertex,joint,name,weight\n0,0,root,1\n1,2,leaf,0.75\n1,0,root,0.25\n");
}

TEST(RigFilesTest, SkeletonJsonReadsBackExactly) {
  TransferAnswer answer;
  answer.joints = SmallRig().joints;
  const Points joints = SmallRig().result.rig.joints;
  answer.result.source_rig.joints = joints;
  answer.result.reference_rig.joints = 2 * joints;
  answer.result.target_joints = 3 * joints;
  answer.result.transforms.resize(3);
  answer.result.transforms[1].linear << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  answer.result.transforms[1].translation << 0.1f, 0.2f, 0.3f;
  const auto json = nlohmann::json::parse(SkeletonJson(answer));
  EXPECT_EQ(json["format"], "stance-skeleton-1");
  EXPECT_EQ(ReadPoints(json["joints"]["source"]), joints);
  EXPECT_EQ(ReadPoints(json["joints"]["reference"]), Points(2 * joints));
  EXPECT_EQ(ReadPoints(json["joints"]["target"]), Points(3 * joints));
  ASSERT_EQ(json["transforms"].size(), 3u);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      EXPECT_EQ(json["transforms"][1][row][column].get<float>(), 3 * row + column + 1);
    }
    EXPECT_EQ(json["transforms"][1][row][3].get<float>(), answer.result.transforms[1].translation(row));
  }
}

}  // namespace
}  // namespace stance
