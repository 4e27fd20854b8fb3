// Requests and answers between core's values and the contract's messages.
#include <gmock/gmock.h>
#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/channel.h"
#include "client/request.h"
#include "client/response.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
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
    SkeletonToWire({"root", "tip"}, {-1, 0}, joints, skeleton);
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

TEST(RequestTest, SendsOnlyWhatTheComputationReads) {
  TransferOptions options;
  options.source_up = UpAxis::kZ;
  options.twist = Twist::kInherited;
  CallOptions call;
  call.want_weights = false;
  call.model = "m";
  call.request_id = "id";
  const v1::TransferRequest request =
      MakeTransferRequest(WithNormals(Quad()), WithNormals(Quad()), options, call);
  EXPECT_EQ(request.source().arrays().positions().size(), 4 * 12u);
  EXPECT_EQ(request.source().arrays().indices().size(), 2 * 12u);
  EXPECT_EQ(request.source().arrays().normals().size(), 4 * 12u);
  EXPECT_TRUE(request.source().arrays().texcoords().empty());
  EXPECT_TRUE(request.reference().arrays().normals().empty());
  EXPECT_EQ(request.source().up_axis(), v1::UP_AXIS_Z);
  EXPECT_EQ(request.reference().up_axis(), v1::UP_AXIS_Y);
  EXPECT_EQ(request.options().method(), v1::METHOD_SKELETAL);
  EXPECT_EQ(request.options().twist(), v1::TWIST_INHERITED);
  EXPECT_EQ(request.options().max_influences(), 4u);
  EXPECT_EQ(request.options().bone_naming(), v1::BONE_NAMING_SMPL);
  EXPECT_EQ(request.options().target_format(), v1::OUTPUT_FORMAT_ARRAYS);
  EXPECT_THAT(
      request.options().outputs(),
      ElementsAre(v1::TRANSFER_OUTPUT_TARGET, v1::TRANSFER_OUTPUT_SKELETONS, v1::TRANSFER_OUTPUT_TRANSFORMS));
  EXPECT_EQ(request.options().model(), "m");
  EXPECT_EQ(request.request_id(), "id");
}

TEST(RequestTest, SetsOnlyTheParameterOfTheChosenSmoothing) {
  TransferOptions options;
  const auto smoothing = [&] { return MakeRigRequest(Quad(), options, {}).options().smoothing(); };
  EXPECT_EQ(smoothing().kind(), v1::SMOOTHING_KIND_METRIC);
  EXPECT_DOUBLE_EQ(smoothing().length(), SmoothingOptions().length);
  EXPECT_FALSE(smoothing().has_lambda());
  options.smoothing.kind = SmoothingKind::kHopwise;
  EXPECT_EQ(smoothing().kind(), v1::SMOOTHING_KIND_HOPWISE);
  EXPECT_DOUBLE_EQ(smoothing().lambda(), 20.0);
  EXPECT_FALSE(smoothing().has_length());
  options.smoothing.kind = SmoothingKind::kNone;
  EXPECT_EQ(smoothing().kind(), v1::SMOOTHING_KIND_NONE);
  EXPECT_FALSE(smoothing().has_length() || smoothing().has_lambda());
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
  EXPECT_EQ(answer->model, "m");
  EXPECT_EQ(answer->request_id, "id");
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
  EXPECT_THAT(refused([](auto* r) { r->mutable_weights()->mutable_values()->pop_back(); }),
              HasSubstr("weights.values"));
}

TEST(NameBonesTest, NamesTheHumanSkeletonOnly) {
  JointTree human = {HumanSkeleton().names(), HumanSkeleton().parents()};
  NameBones(BoneNaming::kMixamo, &human);
  EXPECT_EQ(human.names, HumanBoneNames(BoneNaming::kMixamo));
  JointTree other = {{"root", "tip"}, {-1, 0}};
  NameBones(BoneNaming::kMixamo, &other);
  EXPECT_THAT(other.names, ElementsAre("root", "tip"));
}

TEST(FromGrpcStatusTest, KeepsCodeAndTextAndAddsTheDetails) {
  EXPECT_TRUE(FromGrpcStatus(grpc::Status::OK).ok());
  google::rpc::Status details;
  google::rpc::BadRequest bad_request;
  bad_request.add_field_violations()->set_field("source.arrays.indices");
  details.add_details()->PackFrom(bad_request);
  google::rpc::ErrorInfo info;
  info.set_reason("INVALID_MESH");
  details.add_details()->PackFrom(info);
  const absl::Status status = FromGrpcStatus(grpc::Status(
      grpc::StatusCode::INVALID_ARGUMENT, "index 9 is out of range", details.SerializeAsString()));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(std::string(status.message()), "source.arrays.indices: index 9 is out of range [INVALID_MESH]");
}

TEST(FromGrpcStatusTest, DetailsThatAreNotAStatusAreIgnored) {
  const absl::Status status =
      FromGrpcStatus(grpc::Status(grpc::StatusCode::UNAVAILABLE, "full", "\xff\xff not a message"));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(std::string(status.message()), "full");
}

TEST(ServiceConfigTest, IsJsonWithRetriesOnUnavailableOnly) {
  const auto json = nlohmann::json::parse(ServiceConfigJson({}));
  const auto& method = json["methodConfig"][0];
  EXPECT_EQ(method["retryPolicy"]["maxAttempts"], 4);
  EXPECT_EQ(method["retryPolicy"]["retryableStatusCodes"], nlohmann::json({"UNAVAILABLE"}));
  EXPECT_TRUE(json["loadBalancingConfig"][0].contains("round_robin"));
  ClientOptions once;
  once.max_attempts = 1;
  EXPECT_FALSE(nlohmann::json::parse(ServiceConfigJson(once))["methodConfig"][0].contains("retryPolicy"));
}

TEST(ConnectTest, NobodyListeningIsUnavailableAndNamesTheServer) {
  ClientOptions options;
  options.server = "unix:/nonexistent/stance.sock";
  options.connect_timeout = std::chrono::milliseconds(50);
  const auto client = StanceClient::Connect(options);
  EXPECT_EQ(client.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(client.status().message()), HasSubstr(options.server));
}

}  // namespace
}  // namespace stance
