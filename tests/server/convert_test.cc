#include "server/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "proto/wire/mesh_wire.h"
#include "server/status_map.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Catalog CatalogOf(const std::vector<Method>& methods) {
  Catalog catalog{{}, HumanSkeleton(), {.max_vertices = 500, .max_faces = 900}};
  for (const Method method : methods) {
    ModelInfo& model = catalog.models.emplace_back();
    model.name = MethodName(method) + "-human24";
    model.method = method;
  }
  return catalog;
}
Catalog TestCatalog() { return CatalogOf({Method::kSkeletal}); }
Catalog BothMethods() { return CatalogOf({Method::kStance, Method::kSkeletal}); }

v1::Mesh ArraysMesh() {
  v1::Mesh mesh;
  MeshToArrays(testing::Box(), mesh.mutable_arrays());
  return mesh;
}

v1::TransferRequest GoodTransfer() {
  v1::TransferRequest request;
  *request.mutable_source() = ArraysMesh();
  *request.mutable_reference() = ArraysMesh();
  return request;
}

// The path in the error's BadRequest; empty if it has none.
std::string FieldOf(const absl::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(ToGrpcStatus(status).error_details()));
  google::rpc::BadRequest bad_request;
  for (const auto& detail : details.details()) {
    if (detail.UnpackTo(&bad_request)) return bad_request.field_violations(0).field();
  }
  return "";
}

TEST(PlanTransferTest, DefaultsAreCoresOwn) {
  const Catalog catalog = TestCatalog();
  const absl::StatusOr<TransferPlan> plan = PlanTransfer(GoodTransfer(), catalog);
  ASSERT_TRUE(plan.ok()) << plan.status();
  const TransferOptions defaults;
  EXPECT_EQ(plan->options.method, Method::kSkeletal);
  EXPECT_EQ(plan->options.smoothing.kind, defaults.smoothing.kind);
  EXPECT_EQ(plan->options.smoothing.length, defaults.smoothing.length);
  EXPECT_EQ(plan->options.twist, defaults.twist);
  EXPECT_EQ(plan->options.max_influences, defaults.max_influences);
  EXPECT_EQ(plan->options.source_up, UpAxis::kY);
  EXPECT_EQ(plan->options.limits.max_vertices, 500);
  EXPECT_EQ(plan->options.limits.max_faces, 900);
  EXPECT_EQ(plan->model, "skeletal-human24");
  EXPECT_TRUE(plan->want_target);
  EXPECT_FALSE(plan->want_skeletons);
  EXPECT_FALSE(plan->want_weights);
  EXPECT_FALSE(plan->options.reference_weights);
  EXPECT_EQ(plan->target_format, v1::OUTPUT_FORMAT_ARRAYS);
  EXPECT_EQ(plan->priority, Priority::kNormal);
}

TEST(PlanTransferTest, TakesOverEachOption) {
  v1::TransferRequest request = GoodTransfer();
  request.mutable_source()->set_up_axis(v1::UP_AXIS_Z);
  request.mutable_reference()->set_up_axis(v1::UP_AXIS_X);
  auto* options = request.mutable_options();
  options->set_method(v1::METHOD_SKELETAL);
  options->set_model("skeletal-human24");
  options->add_outputs(v1::TRANSFER_OUTPUT_WEIGHTS);
  options->add_outputs(v1::TRANSFER_OUTPUT_REFERENCE_WEIGHTS);
  options->mutable_smoothing()->set_kind(v1::SMOOTHING_KIND_HOPWISE);
  options->mutable_smoothing()->set_lambda(7);
  options->set_max_influences(0);
  options->set_target_format(v1::OUTPUT_FORMAT_GLB);
  options->set_bone_naming(v1::BONE_NAMING_MIXAMO);
  options->set_twist(v1::TWIST_INHERITED);
  options->set_facing(v1::FACING_SOURCE);
  options->set_ground(v1::GROUND_SOURCE);
  request.set_priority(v1::PRIORITY_BULK);
  const absl::StatusOr<TransferPlan> plan = PlanTransfer(request, TestCatalog());
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->options.source_up, UpAxis::kZ);
  EXPECT_EQ(plan->options.reference_up, UpAxis::kX);
  EXPECT_FALSE(plan->want_target);
  EXPECT_TRUE(plan->want_weights);
  EXPECT_TRUE(plan->options.reference_weights);
  EXPECT_EQ(plan->options.smoothing.kind, SmoothingKind::kHopwise);
  EXPECT_EQ(plan->options.smoothing.lambda, 7);
  EXPECT_EQ(plan->options.max_influences, 0);
  EXPECT_EQ(plan->target_format, v1::OUTPUT_FORMAT_GLB);
  EXPECT_EQ(plan->bone_naming, BoneNaming::kMixamo);
  EXPECT_EQ(plan->options.twist, Twist::kInherited);
  EXPECT_EQ(plan->options.facing, Facing::kSource);
  EXPECT_EQ(plan->options.ground, Ground::kSource);
  EXPECT_EQ(plan->priority, Priority::kBulk);
}

TEST(PlanTransferTest, MethodAndModelNameEachOther) {
  const auto plan = [](v1::Method method, const std::string& model) {
    v1::TransferRequest request = GoodTransfer();
    request.mutable_options()->set_method(method);
    request.mutable_options()->set_model(model);
    return PlanTransfer(request, BothMethods());
  };
  const auto expect = [](const absl::StatusOr<TransferPlan>& got, Method method) {
    ASSERT_TRUE(got.ok()) << got.status();
    EXPECT_EQ(got->options.method, method);
    EXPECT_EQ(got->model, MethodName(method) + "-human24");
  };
  expect(plan(v1::METHOD_UNSPECIFIED, ""), Method::kStance);
  expect(plan(v1::METHOD_SKELETAL, ""), Method::kSkeletal);
  expect(plan(v1::METHOD_STANCE, ""), Method::kStance);
  expect(plan(v1::METHOD_UNSPECIFIED, "skeletal-human24"), Method::kSkeletal);
  expect(plan(v1::METHOD_SKELETAL, "skeletal-human24"), Method::kSkeletal);
  const absl::Status status = plan(v1::METHOD_STANCE, "skeletal-human24").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("no model \"skeletal-human24\" of METHOD_STANCE"));
}

TEST(PlanTransferTest, AMethodWithoutAModelIsNamedWithThoseLoaded) {
  v1::TransferRequest request = GoodTransfer();
  request.mutable_options()->set_method(v1::METHOD_STANCE);
  const absl::Status status = PlanTransfer(request, TestCatalog()).status();
  EXPECT_EQ(ReasonOf(status), "METHOD_NOT_LOADED");
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("METHOD_STANCE"), HasSubstr("loaded: METHOD_SKELETAL")));
}

TEST(PlanTransferTest, TheTargetHasTheFormOfTheSource) {
  v1::TransferRequest request = GoodTransfer();
  request.mutable_source()->mutable_file()->set_format(v1::MESH_FORMAT_PLY);
  EXPECT_EQ(PlanTransfer(request, TestCatalog())->target_format, v1::OUTPUT_FORMAT_PLY);
  request.mutable_options()->set_target_format(v1::OUTPUT_FORMAT_ARRAYS);
  EXPECT_EQ(PlanTransfer(request, TestCatalog())->target_format, v1::OUTPUT_FORMAT_ARRAYS);
}

struct BadRequest {
  const char* field;
  absl::StatusCode code;
  std::function<void(v1::TransferRequest&)> spoil;
};
class BadPlanTest : public ::testing::TestWithParam<BadRequest> {};

TEST_P(BadPlanTest, IsRefusedNamingTheField) {
  v1::TransferRequest request = GoodTransfer();
  GetParam().spoil(request);
  const absl::Status status = PlanTransfer(request, TestCatalog()).status();
  EXPECT_EQ(status.code(), GetParam().code) << status;
  EXPECT_EQ(FieldOf(status), GetParam().field);
}

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
auto Options(void (*spoil)(v1::TransferOptions&)) {
  return [spoil](v1::TransferRequest& request) { spoil(*request.mutable_options()); };
}

INSTANTIATE_TEST_SUITE_P(
    Requests, BadPlanTest,
    ::testing::Values(
        BadRequest{"source", kInvalid, [](v1::TransferRequest& r) { r.clear_source(); }},
        BadRequest{"reference", kInvalid, [](v1::TransferRequest& r) { r.clear_reference(); }},
        BadRequest{"source.up_axis", kInvalid,
                   [](v1::TransferRequest& r) { r.mutable_source()->set_up_axis(v1::UpAxis(9)); }},
        BadRequest{"source.file.format", kInvalid,
                   [](v1::TransferRequest& r) { r.mutable_source()->mutable_file()->set_content("x"); }},
        BadRequest{"options.method", absl::StatusCode::kFailedPrecondition,
                   Options([](v1::TransferOptions& o) { o.set_method(v1::METHOD_NEURAL); })},
        BadRequest{"options.method", absl::StatusCode::kFailedPrecondition,
                   Options([](v1::TransferOptions& o) { o.set_method(v1::METHOD_STANCE); })},
        BadRequest{"options.method", kInvalid,
                   Options([](v1::TransferOptions& o) { o.set_method(v1::Method(99)); })},
        BadRequest{"options.model", absl::StatusCode::kNotFound,
                   Options([](v1::TransferOptions& o) { o.set_model("other"); })},
        BadRequest{"options.outputs[1]", kInvalid, Options([](v1::TransferOptions& o) {
                     o.add_outputs(v1::TRANSFER_OUTPUT_TARGET);
                     o.add_outputs(v1::TRANSFER_OUTPUT_UNSPECIFIED);
                   })},
        BadRequest{"options.smoothing.kind", kInvalid, Options([](v1::TransferOptions& o) {
                     o.mutable_smoothing()->set_kind(v1::SmoothingKind(9));
                   })},
        BadRequest{"options.smoothing.length", kInvalid,
                   Options([](v1::TransferOptions& o) { o.mutable_smoothing()->set_length(0); })},
        BadRequest{"options.smoothing.length", kInvalid,
                   Options([](v1::TransferOptions& o) { o.mutable_smoothing()->set_length(std::nan("")); })},
        BadRequest{"options.smoothing.lambda", kInvalid,
                   Options([](v1::TransferOptions& o) { o.mutable_smoothing()->set_lambda(20); })},
        BadRequest{"options.smoothing.lambda", kInvalid, Options([](v1::TransferOptions& o) {
                     o.mutable_smoothing()->set_kind(v1::SMOOTHING_KIND_HOPWISE);
                     o.mutable_smoothing()->set_lambda(10001);
                   })},
        BadRequest{"options.max_influences", kInvalid,
                   Options([](v1::TransferOptions& o) { o.set_max_influences(25); })},
        BadRequest{"options.target_format", kInvalid,
                   Options([](v1::TransferOptions& o) { o.set_target_format(v1::OutputFormat(77)); })},
        BadRequest{"options.twist", kInvalid,
                   Options([](v1::TransferOptions& o) { o.set_twist(v1::Twist(7)); })},
        BadRequest{"options.facing", kInvalid,
                   Options([](v1::TransferOptions& o) { o.set_facing(v1::Facing(7)); })},
        BadRequest{"options.ground", kInvalid,
                   Options([](v1::TransferOptions& o) { o.set_ground(v1::Ground(7)); })},
        BadRequest{"options.bone_naming", kInvalid,
                   Options([](v1::TransferOptions& o) { o.set_bone_naming(v1::BoneNaming(50)); })}));

TEST(PlanRigTest, NeedsAMesh) {
  EXPECT_EQ(FieldOf(PlanRig(v1::RigRequest(), TestCatalog()).status()), "mesh");
  v1::RigRequest request;
  *request.mutable_mesh() = ArraysMesh();
  EXPECT_TRUE(PlanRig(request, TestCatalog()).ok());
}

TEST(PlanRigTest, TakesOverThePriority) {
  v1::RigRequest request;
  *request.mutable_mesh() = ArraysMesh();
  const auto planned = [&](v1::Priority priority) {
    request.set_priority(priority);
    return PlanRig(request, TestCatalog());
  };
  EXPECT_EQ(planned(v1::PRIORITY_UNSPECIFIED)->priority, Priority::kNormal);
  EXPECT_EQ(planned(v1::PRIORITY_NORMAL)->priority, Priority::kNormal);
  EXPECT_EQ(planned(v1::PRIORITY_INTERACTIVE)->priority, Priority::kInteractive);
  const absl::Status unknown = planned(v1::Priority(9)).status();
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(FieldOf(unknown), "priority");
}

TEST(DecodeMeshTest, NamesTheArrayAtFault) {
  v1::Mesh mesh = ArraysMesh();
  mesh.mutable_arrays()->mutable_positions()->push_back('x');
  EXPECT_EQ(FieldOf(DecodeMesh(mesh, "source").status()), "source.arrays.positions");
  mesh = ArraysMesh();
  mesh.mutable_arrays()->mutable_indices()->pop_back();
  EXPECT_EQ(FieldOf(DecodeMesh(mesh, "reference").status()), "reference.arrays.indices");
  mesh = ArraysMesh();
  mesh.mutable_arrays()->set_normals(std::string(12, '\0'));
  EXPECT_EQ(FieldOf(DecodeMesh(mesh, "mesh").status()), "mesh.arrays.normals");
  EXPECT_EQ(FieldOf(DecodeMesh(v1::Mesh(), "source").status()), "source.data");
}

TEST(DecodeMeshTest, NamesTheFileAtFault) {
  v1::Mesh mesh;
  mesh.mutable_file()->set_content("not a mesh");
  mesh.mutable_file()->set_format(v1::MESH_FORMAT_GLB);
  const absl::Status status = DecodeMesh(mesh, "source").status();
  EXPECT_EQ(status.code(), kInvalid);
  EXPECT_EQ(FieldOf(status), "source.file.content");
}

TEST(EstimateVerticesTest, IsExactForArraysAndPositiveForAll) {
  EXPECT_EQ(EstimateVertices(ArraysMesh()), 8);
  EXPECT_EQ(EstimateVertices(v1::Mesh()), 1);
  v1::Mesh file;
  file.mutable_file()->set_content(std::string(48'000, 'x'));
  EXPECT_EQ(EstimateVertices(file), 1000);
}

// A result whose every field can be told apart.
TransferResult SomeResult() {
  TransferResult result;
  result.target = testing::Box(2, 3, 4);
  result.source_rig.joints = Points::Constant(kHumanJoints, 3, 1.0f);
  result.reference_rig.joints = Points::Constant(kHumanJoints, 3, 2.0f);
  result.target_joints = Points::Constant(kHumanJoints, 3, 3.0f);
  result.source_rig.weights = RowMatrix::Zero(8, kHumanJoints);
  result.source_rig.weights.col(5).setOnes();
  result.reference_rig.weights = RowMatrix::Zero(8, kHumanJoints);
  result.reference_rig.weights.col(6).setOnes();
  result.transforms.assign(kHumanJoints, AffineTransform());
  result.confidence = 0.5f;
  result.source_rig.confidence = Eigen::VectorXf::Constant(kHumanJoints, 0.25f);
  result.reference_rig.confidence = Eigen::VectorXf::Constant(kHumanJoints, 0.75f);
  result.warnings = {"source: odd"};
  result.seconds.network = 0.25;
  return result;
}

TEST(EncodeTransferTest, HoldsOnlyWhatWasAskedFor) {
  const Catalog catalog = TestCatalog();
  const v1::TransferRequest request = GoodTransfer();
  const TransferPlan plan = PlanTransfer(request, catalog).value();
  v1::TransferResponse response;
  ASSERT_TRUE(EncodeTransfer(plan, SomeResult(), catalog, request.source().up_axis(), &response).ok());
  EXPECT_EQ(response.target().arrays().positions().size(), 8u * 12u);
  EXPECT_FALSE(response.has_source_skeleton());
  EXPECT_FALSE(response.has_weights());
  EXPECT_FALSE(response.has_reference_weights());
  EXPECT_EQ(response.joint_transforms_size(), 0);
  EXPECT_EQ(response.confidence(), 0.5f);
  EXPECT_THAT(response.warnings(), ElementsAre("source: odd"));
  EXPECT_EQ(response.model(), "skeletal-human24");
  EXPECT_EQ(response.timings().network_seconds(), 0.25);
}

TEST(EncodeTransferTest, HoldsEverythingThatWasAskedFor) {
  const Catalog catalog = TestCatalog();
  v1::TransferRequest request = GoodTransfer();
  request.mutable_source()->set_up_axis(v1::UP_AXIS_Z);
  for (int output = v1::TRANSFER_OUTPUT_TARGET; output <= v1::TransferOutput_MAX; ++output) {
    request.mutable_options()->add_outputs(static_cast<v1::TransferOutput>(output));
  }
  request.mutable_options()->set_target_format(v1::OUTPUT_FORMAT_OBJ);
  const TransferPlan plan = PlanTransfer(request, catalog).value();
  v1::TransferResponse response;
  ASSERT_TRUE(EncodeTransfer(plan, SomeResult(), catalog, request.source().up_axis(), &response).ok());
  EXPECT_EQ(response.target().up_axis(), v1::UP_AXIS_Z);
  const absl::StatusOr<TriangleMesh> target = DecodeMesh(response.target(), "target");
  ASSERT_TRUE(target.ok()) << target.status();
  EXPECT_TRUE(target->positions.isApprox(testing::Box(2, 3, 4).positions));
  EXPECT_EQ(response.source_skeleton().positions(0), 1.0f);
  EXPECT_EQ(response.reference_skeleton().positions(0), 2.0f);
  EXPECT_EQ(response.target_skeleton().positions(0), 3.0f);
  EXPECT_EQ(response.source_skeleton().names_size(), kHumanJoints);
  EXPECT_EQ(response.source_skeleton().parents(0), -1);
  ASSERT_EQ(response.source_skeleton().confidence_size(), kHumanJoints);
  EXPECT_EQ(response.source_skeleton().confidence(3), 0.25f);
  ASSERT_EQ(response.reference_skeleton().confidence_size(), kHumanJoints);
  EXPECT_EQ(response.reference_skeleton().confidence(3), 0.75f);
  EXPECT_EQ(response.target_skeleton().confidence_size(), 0);
  EXPECT_EQ(response.weights().joint_indices()[0], 5);
  EXPECT_EQ(response.reference_weights().joint_indices()[0], 6);
  EXPECT_EQ(response.joint_transforms_size(), 12 * kHumanJoints);
}

TEST(EncodeTransferTest, ConfidenceIsUnsetWhereItIsNotKnown) {
  const Catalog catalog = TestCatalog();
  v1::TransferRequest request = GoodTransfer();
  request.mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_SKELETONS);
  TransferResult result = SomeResult();
  result.confidence.reset();
  result.source_rig.confidence.resize(0);
  v1::TransferResponse response;
  ASSERT_TRUE(EncodeTransfer(PlanTransfer(request, catalog).value(), result, catalog,
                             request.source().up_axis(), &response)
                  .ok());
  EXPECT_FALSE(response.has_confidence());
  EXPECT_EQ(response.source_skeleton().confidence_size(), 0);
}

TEST(EncodeRigTest, HoldsTheConfidences) {
  const Catalog catalog = BothMethods();
  v1::RigRequest request;
  *request.mutable_mesh() = ArraysMesh();
  RigResult result;
  result.rig = SomeResult().source_rig;
  v1::RigResponse response;
  EncodeRig(PlanRig(request, catalog).value(), result, catalog, &response);
  EXPECT_EQ(response.skeleton().confidence_size(), kHumanJoints);
  EXPECT_EQ(response.model(), "stance-human24");
}

}  // namespace
}  // namespace stance
