#include "client/response.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/mesh_wire.h"
#include "proto/wire/rig_wire.h"

namespace stance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TriangleMesh Quad() {
  TriangleMesh mesh;
  mesh.positions.resize(4, 3);
  mesh.positions << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 2, 3;
  mesh.texcoords = mesh.positions.leftCols(2);
  mesh.groups = {{"all", 0, 2}};
  return mesh;
}

TriangleMesh WithNormals(TriangleMesh mesh) {
  mesh.normals = Eigen::RowVector3f(0, 0, 1).replicate(mesh.vertex_count(), 1);
  return mesh;
}

// A server's answer: the source moved by (1, 2, 3), two joints.
v1::TransferResponse Answer(const TriangleMesh& source) {
  v1::TransferResponse response;
  TriangleMesh target;
  target.positions = source.positions.rowwise() + Eigen::RowVector3f(1, 2, 3);
  target.faces = source.faces;
  target.normals = source.normals;
  MeshToArrays(target, response.mutable_target()->mutable_arrays());
  Points joints(2, 3);
  joints << 0, 0, 0, 0, 1, 0;
  for (v1::Skeleton* skeleton : {response.mutable_source_skeleton(), response.mutable_reference_skeleton(),
                                 response.mutable_target_skeleton()}) {
    SkeletonToWire({"root", "tip"}, {-1, 0}, joints, {}, skeleton);
    joints *= 2;
  }
  RowMatrix weights = RowMatrix::Constant(source.vertex_count(), 2, 0.5f);
  WeightsToWire(weights, response.mutable_weights());
  TransformsToWire(std::vector<AffineTransform>(2), response.mutable_joint_transforms());
  response.add_warnings("source: odd");
  response.mutable_timings()->set_queue_seconds(0.25);
  response.mutable_timings()->set_network_seconds(0.5);
  response.mutable_timings()->set_total_seconds(1.5);
  response.set_model("m");
  response.set_request_id("id");
  return response;
}

TEST(ResponseTest, TargetHasTheSourcesFacesTexcoordsAndGroups) {
  const TriangleMesh source = WithNormals(Quad());
  const absl::StatusOr<TransferAnswer> answer = ReadTransferResponse(Answer(source), source);
  ASSERT_TRUE(answer.ok()) << answer.status();
  const TransferResult& result = answer->result;
  EXPECT_EQ(result.target.positions, Points(source.positions.rowwise() + Eigen::RowVector3f(1, 2, 3)));
  EXPECT_EQ(result.target.faces, source.faces);
  EXPECT_EQ(result.target.texcoords, source.texcoords);
  EXPECT_EQ(result.target.normals, source.normals);
  ASSERT_EQ(result.target.groups.size(), 1u);
  EXPECT_EQ(result.target.groups[0].name, "all");
  EXPECT_THAT(answer->joints.names, ElementsAre("root", "tip"));
  EXPECT_THAT(answer->joints.parents, ElementsAre(-1, 0));
  EXPECT_EQ(result.source_rig.joints(1, 1), 1.0f);
  EXPECT_EQ(result.reference_rig.joints(1, 1), 2.0f);
  EXPECT_EQ(result.target_joints(1, 1), 4.0f);
  EXPECT_EQ(result.source_rig.weights, RowMatrix::Constant(4, 2, 0.5f));
  EXPECT_EQ(result.reference_rig.weights.rows(), 0);
  EXPECT_EQ(result.transforms.size(), 2u);
  EXPECT_THAT(result.warnings, ElementsAre("source: odd"));
  EXPECT_EQ(result.seconds.network, 0.5);
  EXPECT_EQ(result.seconds.total, 1.5);
  EXPECT_EQ(answer->service.queue, 0.25);
  EXPECT_EQ(answer->result.model, "m");
  EXPECT_EQ(answer->request_id, "id");
}

TEST(ResponseTest, ConfidenceIsReadWhereItIsKnown) {
  const TriangleMesh source = Quad();
  v1::TransferResponse response = Answer(source);
  auto answer = ReadTransferResponse(response, source);
  ASSERT_TRUE(answer.ok());
  EXPECT_FALSE(answer->result.confidence.has_value());
  EXPECT_EQ(answer->result.source_rig.confidence.size(), 0);
  for (const float value : {0.25f, 0.5f}) response.mutable_source_skeleton()->add_confidence(value);
  for (const float value : {0.75f, 1.0f}) response.mutable_reference_skeleton()->add_confidence(value);
  response.set_confidence(0);
  answer = ReadTransferResponse(response, source);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer->result.confidence, 0);
  EXPECT_EQ(answer->result.source_rig.confidence, (Eigen::VectorXf{{0.25f, 0.5f}}));
  EXPECT_EQ(answer->result.reference_rig.confidence, (Eigen::VectorXf{{0.75f, 1.0f}}));
}

TEST(ResponseTest, ServerInfoHasTheModelsMethodsAndTheDefault) {
  v1::GetServerInfoResponse response;
  for (const v1::Method method : {v1::METHOD_STANCE, v1::METHOD_SKELETAL}) {
    response.add_methods(method);
    response.add_models()->set_method(method);
  }
  response.set_default_method(v1::METHOD_STANCE);
  response.mutable_limits()->set_max_queued_vertices(5000);
  response.mutable_limits()->set_max_queued_requests_per_client(7);
  response.mutable_limits()->set_max_stream_references(3);
  const ServerInfo info = ReadServerInfo(response);
  EXPECT_THAT(info.methods, ElementsAre("stance", "skeletal"));
  EXPECT_EQ(info.default_method, "stance");
  EXPECT_EQ(info.models[0].method, "stance");
  EXPECT_EQ(info.models[1].method, "skeletal");
  EXPECT_EQ(info.max_queued_vertices, 5000);
  EXPECT_EQ(info.max_queued_requests_per_client, 7);
  EXPECT_EQ(info.max_stream_references, 3);
}

TEST(ResponseTest, AnAnswerThatDoesNotFitIsInternalAndNamesTheField) {
  const TriangleMesh source = Quad();
  const auto refused = [&](auto change) {
    v1::TransferResponse response = Answer(source);
    change(&response);
    const auto answer = ReadTransferResponse(response, source);
    EXPECT_EQ(answer.status().code(), absl::StatusCode::kInternal);
    return std::string(answer.status().message());
  };
  EXPECT_THAT(refused([](auto* r) { r->clear_target(); }), HasSubstr("target.data"));
  EXPECT_THAT(
      refused([](auto* r) { r->mutable_target()->mutable_arrays()->mutable_positions()->resize(24); }),
      HasSubstr("target has 2 rows, want 4"));
  EXPECT_THAT(refused([](auto* r) { r->mutable_target_skeleton()->add_names("extra"); }),
              HasSubstr("target_skeleton.names"));
  EXPECT_THAT(refused([](auto* r) { r->mutable_joint_transforms()->RemoveLast(); }),
              HasSubstr("joint_transforms"));
  EXPECT_THAT(refused([](auto* r) { r->mutable_joint_transforms()->Truncate(12); }),
              HasSubstr("joint_transforms has 1 rows, want 2"));
  EXPECT_THAT(refused([](auto* r) { r->set_confidence(1.5f); }), HasSubstr("confidence is 1.5"));
  EXPECT_THAT(refused([](auto* r) { r->mutable_source_skeleton()->add_confidence(1); }),
              HasSubstr("source_skeleton.confidence"));
  EXPECT_THAT(refused([](auto* r) { r->mutable_weights()->mutable_values()->pop_back(); }),
              HasSubstr("weights.values"));
}

}  // namespace
}  // namespace stance
