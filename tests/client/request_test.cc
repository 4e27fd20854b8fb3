#include "client/request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stance {
namespace {

using ::testing::ElementsAre;

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

TEST(RequestTest, SendsOnlyWhatTheComputationReads) {
  TransferOptions options;
  options.source_up = UpAxis::kZ;
  options.twist = Twist::kInherited;
  options.facing = Facing::kSource;
  options.ground = Ground::kSource;
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
  EXPECT_EQ(request.options().method(), v1::METHOD_UNSPECIFIED);
  EXPECT_EQ(request.options().twist(), v1::TWIST_INHERITED);
  EXPECT_EQ(request.options().facing(), v1::FACING_SOURCE);
  EXPECT_EQ(request.options().ground(), v1::GROUND_SOURCE);
  EXPECT_EQ(request.options().max_influences(), 4u);
  EXPECT_EQ(request.options().bone_naming(), v1::BONE_NAMING_SMPL);
  EXPECT_EQ(request.options().target_format(), v1::OUTPUT_FORMAT_ARRAYS);
  EXPECT_THAT(
      request.options().outputs(),
      ElementsAre(v1::TRANSFER_OUTPUT_TARGET, v1::TRANSFER_OUTPUT_SKELETONS, v1::TRANSFER_OUTPUT_TRANSFORMS));
  EXPECT_EQ(request.options().model(), "m");
  EXPECT_EQ(request.request_id(), "id");
}

TEST(RequestTest, AStreamSaysWhatATransferSays) {
  TransferOptions options;
  options.source_up = UpAxis::kX;
  options.reference_up = UpAxis::kZ;
  options.facing = Facing::kSource;
  CallOptions call;
  call.request_id = "id";
  call.want_weights = false;
  const v1::TransferRequest whole = MakeTransferRequest(Quad(), Quad(), options, call);
  const v1::AnimateRequest start = MakeAnimateStart(Quad(), options, call);
  const v1::AnimateRequest reference = MakeAnimateReference(Quad(), options);
  EXPECT_EQ(start.start().source().SerializeAsString(), whole.source().SerializeAsString());
  EXPECT_EQ(start.start().options().SerializeAsString(), whole.options().SerializeAsString());
  EXPECT_EQ(start.start().request_id(), "id");
  EXPECT_EQ(reference.reference().reference().SerializeAsString(), whole.reference().SerializeAsString());
}

TEST(RequestTest, TheMethodIsTheServersUnlessChosen) {
  const auto method = [](std::optional<Method> chosen) {
    return MakeTransferRequest(Quad(), Quad(), {.method = chosen}, {}).options().method();
  };
  EXPECT_EQ(method(std::nullopt), v1::METHOD_UNSPECIFIED);
  EXPECT_EQ(method(Method::kSkeletal), v1::METHOD_SKELETAL);
  EXPECT_EQ(method(Method::kStance), v1::METHOD_STANCE);
  EXPECT_EQ(method(Method::kNeural), v1::METHOD_NEURAL);
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

}  // namespace
}  // namespace stance
