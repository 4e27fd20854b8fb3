// The real server over a raw gRPC stub.

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <limits>
#include <memory>

#include "core/mesh/mesh_io.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "proto/wire/mesh_wire.h"
#include "stance/v1/pose_transfer.grpc.pb.h"
#include "stance/v1/server_info.grpc.pb.h"
#include "tests/integration/measured_server.h"
#include "tests/support/meshes.h"
#include "tests/support/process.h"

extern char** environ;

namespace stance {
namespace {

using testing::BackgroundProgram;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MeasuredServer;
using testing::RunProgram;

constexpr char kRunning[] = "stance_running_requests";
constexpr char kQueued[] = "stance_queued_requests";

std::shared_ptr<grpc::Channel> ChannelTo(const MeasuredServer& server) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  // Each test its own connection: gRPC shares one between equal channels.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  return grpc::CreateCustomChannel(server.address(), grpc::InsecureChannelCredentials(), arguments);
}

v1::TransferRequest RequestOf(const TriangleMesh& source, const TriangleMesh& reference) {
  v1::TransferRequest request;
  MeshToArrays(source, request.mutable_source()->mutable_arrays());
  MeshToArrays(reference, request.mutable_reference()->mutable_arrays());
  return request;
}
v1::TransferRequest SmallRequest() { return RequestOf(testing::Icosphere(3), testing::Capsule()); }
// Keeps a worker busy for as long as the other calls of a test take to be sent.
v1::TransferRequest LargeRequest() { return RequestOf(testing::Icosphere(6), testing::Icosphere(6)); }

// What came back from one call.
struct Answer {
  grpc::Status status;
  v1::TransferResponse response;
  std::string pushback;  // grpc-retry-pushback-ms
};

Answer Call(const std::shared_ptr<grpc::Channel>& channel, const v1::TransferRequest& request,
            const std::function<void(grpc::ClientContext&)>& prepare = nullptr) {
  Answer answer;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(2));
  if (prepare) prepare(context);
  answer.status = v1::PoseTransferService::NewStub(channel)->Transfer(&context, request, &answer.response);
  const auto& trailers = context.GetServerTrailingMetadata();
  if (const auto it = trailers.find("grpc-retry-pushback-ms"); it != trailers.end()) {
    answer.pushback = std::string(it->second.data(), it->second.size());
  }
  return answer;
}

// A call on a thread of its own.
std::future<Answer> CallAsync(const std::shared_ptr<grpc::Channel>& channel, v1::TransferRequest request,
                              std::function<void(grpc::ClientContext&)> prepare = nullptr) {
  return std::async(std::launch::async, [channel, request = std::move(request), prepare] {
    return Call(channel, request, prepare);
  });
}

template <typename Message>
Message DetailOf(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  Message message;
  for (const auto& detail : details.details()) {
    if (detail.Is<Message>()) detail.UnpackTo(&message);
  }
  return message;
}
std::string ReasonOf(const grpc::Status& status) { return DetailOf<google::rpc::ErrorInfo>(status).reason(); }
std::string FieldOf(const grpc::Status& status) {
  const auto bad_request = DetailOf<google::rpc::BadRequest>(status);
  return bad_request.field_violations_size() == 1 ? bad_request.field_violations(0).field() : "";
}

TEST(ServerTest, TransfersAndAnswersWhatWasAskedFor) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  v1::TransferRequest request = SmallRequest();
  request.set_request_id("my-request");
  for (int output = v1::TRANSFER_OUTPUT_TARGET; output <= v1::TransferOutput_MAX; ++output) {
    request.mutable_options()->add_outputs(static_cast<v1::TransferOutput>(output));
  }
  const Answer answer = Call(ChannelTo(*server), request);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  const v1::TransferResponse& response = answer.response;
  EXPECT_EQ(response.request_id(), "my-request");
  EXPECT_EQ(response.target().arrays().positions().size(), request.source().arrays().positions().size());
  EXPECT_EQ(response.target().arrays().indices(), request.source().arrays().indices());
  EXPECT_EQ(response.source_skeleton().names_size(), 24);
  EXPECT_EQ(response.weights().vertex_count(), 642u);
  EXPECT_EQ(response.joint_transforms_size(), 24 * 12);
  EXPECT_FALSE(response.model().empty());
  EXPECT_GT(response.timings().network_seconds(), 0);
  EXPECT_GE(response.timings().total_seconds(), response.timings().network_seconds());
  EXPECT_THAT(server->Log(), HasSubstr(R"("request_id":"my-request")"));
}

TEST(ServerTest, TransfersFiles) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  v1::TransferRequest request = SmallRequest();
  const std::string obj = SerializeMesh(testing::Icosphere(3), MeshFormat::kObj).value();
  request.mutable_source()->mutable_file()->set_content(obj);
  request.mutable_source()->mutable_file()->set_format(v1::MESH_FORMAT_OBJ);
  Answer answer = Call(ChannelTo(*server), request);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_EQ(answer.response.target().file().format(), v1::MESH_FORMAT_OBJ);
  const auto target = ParseMesh(answer.response.target().file().content(), MeshFormat::kObj);
  ASSERT_TRUE(target.ok()) << target.status();
  EXPECT_EQ(target->vertex_count(), 642);
  EXPECT_FALSE(answer.response.request_id().empty());
  request.mutable_options()->set_target_format(v1::OUTPUT_FORMAT_GLB);
  answer = Call(ChannelTo(*server), request);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_TRUE(ParseMesh(answer.response.target().file().content(), MeshFormat::kGlb).ok());
}

TEST(ServerTest, Rigs) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  v1::RigRequest request;
  MeshToArrays(testing::Capsule(), request.mutable_mesh()->mutable_arrays());
  v1::RigResponse response;
  grpc::ClientContext context;
  const auto stub = v1::PoseTransferService::NewStub(ChannelTo(*server));
  const grpc::Status status = stub->Rig(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.skeleton().positions_size(), 24 * 3);
  EXPECT_EQ(response.weights().vertex_count() * 12, request.mesh().arrays().positions().size());
  v1::RigRequest bad;
  grpc::ClientContext bad_context;
  const grpc::Status refused = stub->Rig(&bad_context, bad, &response);
  EXPECT_EQ(refused.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(FieldOf(refused), "mesh");
}

void SetFloat(std::string* bytes, size_t index, float value) {
  std::memcpy(bytes->data() + index * sizeof(value), &value, sizeof(value));
}
void SetIndex(std::string* bytes, size_t index, uint32_t value) {
  std::memcpy(bytes->data() + index * sizeof(value), &value, sizeof(value));
}

struct BadInput {
  const char* name;
  const char* field;  // of `source`, without it
  std::function<void(v1::Mesh&)> spoil;
};
const std::vector<BadInput>& BadInputs() {
  static const std::vector<BadInput> inputs = {
      {"no data", ".data", [](v1::Mesh& m) { m.Clear(); }},
      {"empty", "", [](v1::Mesh& m) { m.mutable_arrays()->Clear(); }},
      {"no faces", "", [](v1::Mesh& m) { m.mutable_arrays()->clear_indices(); }},
      {"cut positions", ".arrays.positions",
       [](v1::Mesh& m) { m.mutable_arrays()->mutable_positions()->pop_back(); }},
      {"cut indices", ".arrays.indices",
       [](v1::Mesh& m) { m.mutable_arrays()->mutable_indices()->pop_back(); }},
      {"normals of another count", ".arrays.normals",
       [](v1::Mesh& m) { m.mutable_arrays()->set_normals(std::string(24, '\0')); }},
      {"not a number", "",
       [](v1::Mesh& m) {
         SetFloat(m.mutable_arrays()->mutable_positions(), 7, std::numeric_limits<float>::quiet_NaN());
       }},
      {"infinite", "",
       [](v1::Mesh& m) {
         SetFloat(m.mutable_arrays()->mutable_positions(), 7, std::numeric_limits<float>::infinity());
       }},
      {"index out of range", "",
       [](v1::Mesh& m) { SetIndex(m.mutable_arrays()->mutable_indices(), 4, 100'000); }},
      {"index beyond 31 bits", ".arrays.indices",
       [](v1::Mesh& m) { SetIndex(m.mutable_arrays()->mutable_indices(), 4, 0xffffffff); }},
      {"zero extent", "",
       [](v1::Mesh& m) {
         auto* positions = m.mutable_arrays()->mutable_positions();
         positions->assign(positions->size(), '\0');
       }},
      {"too many vertices", ".arrays.positions",
       [](v1::Mesh& m) { MeshToArrays(testing::Icosphere(5), m.mutable_arrays()); }},
      {"too many faces", ".arrays.indices",
       [](v1::Mesh& m) {
         std::string* indices = m.mutable_arrays()->mutable_indices();
         while (indices->size() <= size_t{12} * 11'000) indices->append(*indices);
       }},
      {"too many vertices in a file", ".file.content",
       [](v1::Mesh& m) {
         m.mutable_file()->set_content(*SerializeMesh(testing::Icosphere(5), MeshFormat::kPly));
         m.mutable_file()->set_format(v1::MESH_FORMAT_PLY);
       }},
      {"not a number in a file", "",
       [](v1::Mesh& m) {
         m.mutable_file()->set_content("OFF 3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n");
         m.mutable_file()->set_format(v1::MESH_FORMAT_OFF);
       }},
      {"unspecified format", ".file.format", [](v1::Mesh& m) { m.mutable_file()->set_content("x"); }},
      {"not a file of that format", ".file.content",
       [](v1::Mesh& m) {
         m.mutable_file()->set_content("glTF? no");
         m.mutable_file()->set_format(v1::MESH_FORMAT_GLB);
       }},
      {"unknown axis", ".up_axis", [](v1::Mesh& m) { m.set_up_axis(v1::UpAxis(42)); }},
  };
  return inputs;
}

// Each bad input, on either side, is refused naming its field; the next request is served.
TEST(ServerTest, RefusesBadMeshesAndServesTheNextRequest) {
  auto server = MeasuredServer::Start({"--limits-max-vertices", "5000", "--limits-max-faces", "10000"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  for (const bool spoil_source : {true, false}) {
    for (const BadInput& input : BadInputs()) {
      SCOPED_TRACE(input.name);
      v1::TransferRequest request = SmallRequest();
      input.spoil(spoil_source ? *request.mutable_source() : *request.mutable_reference());
      const grpc::Status status = Call(channel, request).status;
      EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT) << status.error_message();
      EXPECT_EQ(FieldOf(status), (spoil_source ? "source" : "reference") + std::string(input.field))
          << status.error_message();
    }
    const Answer next = Call(channel, SmallRequest());
    EXPECT_TRUE(next.status.ok()) << next.status.error_message();
  }
  const auto stub = v1::PoseTransferService::NewStub(channel);
  for (const BadInput& input : BadInputs()) {
    SCOPED_TRACE(input.name);
    v1::RigRequest request;
    *request.mutable_mesh() = SmallRequest().source();
    input.spoil(*request.mutable_mesh());
    v1::RigResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub->Rig(&context, request, &response);
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT) << status.error_message();
    EXPECT_EQ(FieldOf(status), "mesh" + std::string(input.field)) << status.error_message();
  }
}

TEST(ServerTest, WarnsOfWhatIsOddButWorkable) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  const Answer answer =
      Call(ChannelTo(*server), RequestOf(testing::WithDegenerateFaces(), testing::TwoSpheres(3)));
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_THAT(answer.response.warnings(), Contains(HasSubstr("source: 3 degenerate faces")));
  EXPECT_THAT(answer.response.warnings(), Contains(HasSubstr("reference: 2 components")));
}

TEST(ServerTest, RefusesBadOptionsByField) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  v1::TransferRequest request = SmallRequest();
  request.mutable_options()->set_method(v1::METHOD_NEURAL);
  grpc::Status status = Call(channel, request).status;
  EXPECT_EQ(status.error_code(), grpc::FAILED_PRECONDITION);
  EXPECT_EQ(FieldOf(status), "options.method");
  request = SmallRequest();
  request.mutable_options()->set_model("nobody");
  status = Call(channel, request).status;
  EXPECT_EQ(status.error_code(), grpc::NOT_FOUND);
  EXPECT_EQ(ReasonOf(status), "MODEL_NOT_FOUND");
  request = SmallRequest();
  request.set_request_id("line\nbreak");
  status = Call(channel, request).status;
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(FieldOf(status), "request_id");
}

// Both methods on one server: the untrained stance model beside the untrained skeletal one.
class TwoModelsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    server_ = MeasuredServer::Start({"--model", STANCE_UNTRAINED_STANCE_MODEL, "--inference-workers", "1"});
    ASSERT_NE(server_, nullptr);
    channel_ = ChannelTo(*server_);
  }
  static v1::TransferRequest RequestFor(v1::Method method) {
    v1::TransferRequest request = SmallRequest();
    request.mutable_options()->set_method(method);
    request.mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_TARGET);
    request.mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_SKELETONS);
    return request;
  }

  std::unique_ptr<MeasuredServer> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST_F(TwoModelsTest, DescribesBothAndTheDefault) {
  v1::GetServerInfoResponse info;
  grpc::ClientContext context;
  const auto stub = v1::ServerInfoService::NewStub(channel_);
  ASSERT_TRUE(stub->GetServerInfo(&context, v1::GetServerInfoRequest(), &info).ok());
  ASSERT_EQ(info.models_size(), 2);
  EXPECT_EQ(info.models(0).name(), "untrained-stance");
  EXPECT_EQ(info.models(0).method(), v1::METHOD_STANCE);
  EXPECT_EQ(info.models(1).method(), v1::METHOD_SKELETAL);
  EXPECT_THAT(info.methods(), ElementsAre(v1::METHOD_STANCE, v1::METHOD_SKELETAL));
  EXPECT_EQ(info.default_method(), v1::METHOD_STANCE);
  EXPECT_THAT(server_->Log(), HasSubstr(R"("models":"untrained-stance, untrained")"));
}

TEST_F(TwoModelsTest, TheMethodIsChosenPerRequest) {
  const Answer unspecified = Call(channel_, RequestFor(v1::METHOD_UNSPECIFIED));
  const Answer stance = Call(channel_, RequestFor(v1::METHOD_STANCE));
  const Answer skeletal = Call(channel_, RequestFor(v1::METHOD_SKELETAL));
  ASSERT_TRUE(unspecified.status.ok()) << unspecified.status.error_message();
  ASSERT_TRUE(stance.status.ok()) << stance.status.error_message();
  ASSERT_TRUE(skeletal.status.ok()) << skeletal.status.error_message();
  EXPECT_EQ(unspecified.response.model(), "untrained-stance");
  EXPECT_EQ(stance.response.model(), "untrained-stance");
  EXPECT_EQ(skeletal.response.model(), "untrained");
  v1::TransferRequest by_name = RequestFor(v1::METHOD_UNSPECIFIED);
  by_name.mutable_options()->set_model("untrained");
  EXPECT_EQ(Call(channel_, by_name).response.model(), "untrained");
}

TEST_F(TwoModelsTest, ConfidenceIsAnsweredWhereItIsKnown) {
  const v1::TransferResponse stance = Call(channel_, RequestFor(v1::METHOD_STANCE)).response;
  ASSERT_TRUE(stance.has_confidence());
  EXPECT_GE(stance.confidence(), 0);
  EXPECT_LE(stance.confidence(), 1);
  for (const v1::Skeleton& skeleton : {stance.source_skeleton(), stance.reference_skeleton()}) {
    ASSERT_EQ(skeleton.confidence_size(), 24);
    for (const float confidence : skeleton.confidence()) {
      EXPECT_GE(confidence, 0);
      EXPECT_LE(confidence, 1);
    }
  }
  EXPECT_EQ(stance.target_skeleton().confidence_size(), 0);
  const v1::TransferResponse skeletal = Call(channel_, RequestFor(v1::METHOD_SKELETAL)).response;
  EXPECT_FALSE(skeletal.has_confidence());
  EXPECT_EQ(skeletal.source_skeleton().confidence_size(), 0);

  v1::RigRequest request;
  *request.mutable_mesh() = SmallRequest().source();
  v1::RigResponse rig;
  grpc::ClientContext context;
  ASSERT_TRUE(v1::PoseTransferService::NewStub(channel_)->Rig(&context, request, &rig).ok());
  EXPECT_EQ(rig.skeleton().confidence_size(), 24);
  EXPECT_EQ(rig.model(), "untrained-stance");
}

// The one worker is busy while both kinds of request arrive: they run as one batch.
TEST_F(TwoModelsTest, ABatchOfBothMethodsAnswersEachAsAlone) {
  const v1::Method methods[] = {v1::METHOD_STANCE, v1::METHOD_SKELETAL, v1::METHOD_STANCE,
                                v1::METHOD_SKELETAL};
  auto running = CallAsync(channel_, LargeRequest());
  server_->AwaitMetric(kRunning, 1);
  std::vector<std::future<Answer>> answers;
  for (const v1::Method method : methods) answers.push_back(CallAsync(channel_, RequestFor(method)));
  server_->AwaitMetric(kQueued, 4);
  EXPECT_TRUE(running.get().status.ok());
  std::vector<Answer> together;
  for (auto& answer : answers) together.push_back(answer.get());
  EXPECT_EQ(server_->Metric("stance_batch_requests_count"), 2);
  for (size_t i = 0; i < together.size(); ++i) {
    const Answer alone = Call(channel_, RequestFor(methods[i]));
    ASSERT_TRUE(together[i].status.ok() && alone.status.ok());
    const auto a = MeshFromWire(together[i].response.target()), b = MeshFromWire(alone.response.target());
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_LT((a->positions - b->positions).cwiseAbs().maxCoeff(), 2e-3f);
    EXPECT_EQ(together[i].response.model(), alone.response.model());
  }
}

TEST_F(TwoModelsTest, FacingAndGroundReachTheTarget) {
  v1::TransferRequest request = RequestFor(v1::METHOD_SKELETAL);
  const auto lowest = [](const v1::Mesh& mesh) { return MeshFromWire(mesh)->positions.col(1).minCoeff(); };
  request.mutable_options()->set_ground(v1::GROUND_SOURCE);
  request.mutable_options()->set_facing(v1::FACING_SOURCE);
  const Answer put = Call(channel_, request);
  ASSERT_TRUE(put.status.ok()) << put.status.error_message();
  EXPECT_NEAR(lowest(put.response.target()), lowest(request.source()), 1e-5f);
  request.mutable_options()->set_facing(v1::Facing(9));
  const grpc::Status status = Call(channel_, request).status;
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(FieldOf(status), "options.facing");
  EXPECT_THAT(status.error_message(), HasSubstr("9"));
}

TEST(ServerTest, AMethodWithoutAModelIsRefused) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  v1::TransferRequest request = SmallRequest();
  request.mutable_options()->set_method(v1::METHOD_STANCE);
  const grpc::Status status = Call(ChannelTo(*server), request).status;
  EXPECT_EQ(status.error_code(), grpc::FAILED_PRECONDITION);
  EXPECT_EQ(ReasonOf(status), "METHOD_NOT_LOADED");
  EXPECT_EQ(FieldOf(status), "options.method");
  EXPECT_THAT(status.error_message(), HasSubstr("loaded: METHOD_SKELETAL"));
}

TEST(ServerTest, RefusesAMessageBeyondItsLimit) {
  auto server = MeasuredServer::Start({"--server-max-message-bytes", "20000"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  EXPECT_EQ(Call(channel, RequestOf(testing::Icosphere(4), testing::Capsule())).status.error_code(),
            grpc::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(Call(channel, RequestOf(testing::Icosphere(2), testing::Icosphere(2))).status.ok());
}

// One worker, one place in the queue: the first call runs, the second waits, the third is refused.
TEST(ServerTest, AFullQueueIsRefusedWithReasonAndPushback) {
  auto server = MeasuredServer::Start({"--inference-workers", "1", "--batching-max-queued-requests", "1"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  auto running = CallAsync(channel, LargeRequest());
  server->AwaitMetric(kRunning, 1);
  auto waiting = CallAsync(channel, SmallRequest());
  server->AwaitMetric(kQueued, 1);
  const Answer refused = Call(channel, SmallRequest());
  EXPECT_EQ(refused.status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(refused.status), "QUEUE_FULL");
  EXPECT_EQ(refused.pushback, "250");
  EXPECT_TRUE(running.get().status.ok());
  EXPECT_TRUE(waiting.get().status.ok());
  EXPECT_EQ(server->Metric("stance_rejections_total{reason=\"QUEUE_FULL\"}"), 1);
  EXPECT_TRUE(Call(channel, SmallRequest()).status.ok());
}

TEST(ServerTest, APassedDeadlineIsNeverRun) {
  auto server = MeasuredServer::Start({"--inference-workers", "1", "--batching-refuse-unmeetable", "false"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  auto running = CallAsync(channel, LargeRequest());
  server->AwaitMetric(kRunning, 1);
  const Answer late = Call(channel, SmallRequest(), [](grpc::ClientContext& context) {
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(30));
  });
  EXPECT_EQ(late.status.error_code(), grpc::DEADLINE_EXCEEDED);
  EXPECT_TRUE(running.get().status.ok());
  EXPECT_TRUE(Call(channel, SmallRequest()).status.ok());
  // The large one and the last one ran, and nothing else.
  EXPECT_EQ(server->Metric("stance_phase_seconds_count{phase=\"queue\"}"), 2);
  EXPECT_EQ(server->Metric("stance_late_starts_total"), 0);
}

TEST(ServerTest, ACancelledCallLeavesTheQueue) {
  auto server = MeasuredServer::Start({"--inference-workers", "1"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  auto running = CallAsync(channel, LargeRequest());
  server->AwaitMetric(kRunning, 1);
  grpc::ClientContext context;  // outlives TryCancel, which the call's end does not wait for
  auto cancelled = std::async(std::launch::async, [&] {
    v1::TransferResponse response;
    return v1::PoseTransferService::NewStub(channel)->Transfer(&context, SmallRequest(), &response);
  });
  server->AwaitMetric(kQueued, 1);
  context.TryCancel();
  EXPECT_EQ(cancelled.get().error_code(), grpc::CANCELLED);
  server->AwaitMetric("stance_rejections_total{reason=\"CANCELLED\"}", 1);
  EXPECT_TRUE(running.get().status.ok());
  EXPECT_EQ(server->Metric("stance_phase_seconds_count{phase=\"queue\"}"), 1);
}

TEST(ServerTest, ACallThatIsCancelledWhileItRunsIsAbandoned) {
  auto server = MeasuredServer::Start({"--inference-workers", "1"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  grpc::ClientContext context;  // outlives TryCancel, as above
  auto cancelled = std::async(std::launch::async, [&] {
    v1::TransferResponse response;
    return v1::PoseTransferService::NewStub(channel)->Transfer(&context, LargeRequest(), &response);
  });
  server->AwaitMetric(kRunning, 1);
  context.TryCancel();
  EXPECT_EQ(cancelled.get().error_code(), grpc::CANCELLED);
  server->AwaitMetric("stance_requests_total{code=\"CANCELLED\",rpc=\"Transfer\"}", 1);
  // The worker may have taken it and not have begun yet.
  const double before = server->Metric("stance_rejections_total{reason=\"CANCELLED\"}");
  EXPECT_EQ(server->Metric("stance_abandoned_requests_total"), before == 1 ? 0 : 1);
  EXPECT_EQ(server->Metric("stance_phase_seconds_count{phase=\"encode\"}"), 0);
  EXPECT_TRUE(Call(channel, SmallRequest()).status.ok());
}

// One worker that takes one call at a time, kept busy; the clients name themselves.
class TurnsTest : public ::testing::Test {
 protected:
  static constexpr char kClientKey[] = "stance-client";

  void Start(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"--inference-workers",           "1",
                                          "--batching-max-batch-requests", "1",
                                          "--batching-client-metadata",    kClientKey};
    arguments.insert(arguments.end(), more.begin(), more.end());
    server_ = MeasuredServer::Start(arguments);
    ASSERT_NE(server_, nullptr);
    channel_ = ChannelTo(*server_);
    calls_.push_back(CallAsync(channel_, LargeRequest()));
    server_->AwaitMetric(kRunning, 1);
  }
  // Sends a call and waits until it waits.
  void Queue(const std::string& client, const std::string& id,
             v1::Priority priority = v1::PRIORITY_UNSPECIFIED) {
    v1::TransferRequest request = SmallRequest();
    request.set_request_id(id);
    request.set_priority(priority);
    calls_.push_back(CallAsync(channel_, request, As(client)));
    server_->AwaitMetric(kQueued, ++queued_);
  }
  static std::function<void(grpc::ClientContext&)> As(const std::string& client) {
    return [client](grpc::ClientContext& context) { context.AddMetadata(kClientKey, client); };
  }
  // The ids in the order in which they were answered, once all are.
  std::vector<std::string> Answered(const std::vector<std::string>& ids) {
    for (auto& call : calls_) EXPECT_TRUE(call.get().status.ok());
    const std::string log = server_->Log();
    std::vector<std::pair<size_t, std::string>> places;
    for (const std::string& id : ids) places.emplace_back(log.find("\"request_id\":\"" + id + "\""), id);
    std::sort(places.begin(), places.end());
    std::vector<std::string> ordered;
    for (const auto& [place, id] : places) ordered.push_back(id);
    return ordered;
  }

  std::unique_ptr<MeasuredServer> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::vector<std::future<Answer>> calls_;
  double queued_ = 0;
};

TEST_F(TurnsTest, AFloodOfOneClientDelaysAnotherByOneCall) {
  Start();
  for (const char* id : {"flood-0", "flood-1", "flood-2"}) Queue("flood", id);
  Queue("other", "other-0");
  EXPECT_EQ(server_->Metric("stance_queued_clients"), 2);
  EXPECT_THAT(Answered({"flood-0", "flood-1", "flood-2", "other-0"}),
              ElementsAre("flood-0", "other-0", "flood-1", "flood-2"));
}

TEST_F(TurnsTest, PrioritiesOrderTheCallsOfOneClient) {
  Start();
  Queue("a", "bulk", v1::PRIORITY_BULK);
  Queue("a", "normal");
  Queue("a", "interactive", v1::PRIORITY_INTERACTIVE);
  Queue("b", "other");
  EXPECT_THAT(Answered({"bulk", "normal", "interactive", "other"}),
              ElementsAre("interactive", "other", "normal", "bulk"));
  v1::TransferRequest wrong = SmallRequest();
  wrong.set_priority(v1::Priority(9));
  const grpc::Status status = Call(channel_, wrong).status;
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(FieldOf(status), "priority");
}

TEST_F(TurnsTest, AClientBeyondItsQuotaIsRefusedAndTheOthersAreNot) {
  Start({"--batching-max-queued-requests-per-client", "1"});
  Queue("a", "first");
  const Answer refused = Call(channel_, SmallRequest(), As("a"));
  EXPECT_EQ(refused.status.error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(refused.status), "CLIENT_QUOTA");
  EXPECT_EQ(refused.pushback, "250");
  Queue("b", "second");
  EXPECT_THAT(Answered({"first", "second"}), ElementsAre("first", "second"));
  EXPECT_EQ(server_->Metric("stance_rejections_total{reason=\"CLIENT_QUOTA\"}"), 1);
}

TEST_F(TurnsTest, AQueueOfTooManyVerticesIsRefused) {
  Start({"--batching-max-queued-vertices", "1000"});
  Queue("a", "first");
  EXPECT_GT(server_->Metric("stance_queued_vertices"), 642);
  const Answer refused = Call(channel_, SmallRequest());
  EXPECT_EQ(refused.status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(refused.status), "QUEUE_VERTICES_FULL");
  EXPECT_EQ(refused.pushback, "250");
  EXPECT_THAT(Answered({"first"}), ElementsAre("first"));
}

// The server learns what a call costs. With eight such calls ahead, one that has time for four is refused at
// once, as is one that has not even time for itself; neither runs.
TEST_F(TurnsTest, WhatCannotMeetItsDeadlineIsRefusedAtOnce) {
  Start();
  EXPECT_TRUE(calls_[0].get().status.ok());
  calls_.clear();
  const v1::TransferRequest request = RequestOf(testing::Icosphere(4), testing::Icosphere(4));
  double seconds = 0;
  for (int i = 0; i < 4; ++i) {
    const Answer answer = Call(channel_, request);
    ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
    seconds = std::max(seconds, answer.response.timings().total_seconds());
  }
  const auto within = [](double patience) {
    return [patience](grpc::ClientContext& context) {
      context.set_deadline(std::chrono::system_clock::now() +
                           std::chrono::microseconds(static_cast<int64_t>(1e6 * patience)));
    };
  };
  const Answer hopeless = Call(channel_, LargeRequest(), within(seconds / 3));
  EXPECT_EQ(hopeless.status.error_code(), grpc::DEADLINE_EXCEEDED);
  for (int i = 0; i < 9; ++i) calls_.push_back(CallAsync(channel_, request));
  server_->AwaitMetric(kQueued, 8);
  const Answer refused = Call(channel_, request, within(4 * seconds));
  EXPECT_EQ(refused.status.error_code(), grpc::UNAVAILABLE) << refused.status.error_message();
  EXPECT_EQ(ReasonOf(refused.status), "DEADLINE_UNMEETABLE");
  EXPECT_GE(std::stoi("0" + refused.pushback), 250);
  for (auto& call : calls_) EXPECT_TRUE(call.get().status.ok());
  EXPECT_EQ(server_->Metric("stance_rejections_total{reason=\"DEADLINE_UNMEETABLE\"}"), 1);
  EXPECT_EQ(server_->Metric("stance_phase_seconds_count{phase=\"queue\"}"), 1 + 4 + 9);
  EXPECT_EQ(server_->Metric("stance_late_starts_total"), 0);
}

TEST(ServerTest, AKilledClientCostsNothingButItsOwnCall) {
  auto server = MeasuredServer::Start({"--inference-workers", "1"});
  ASSERT_NE(server, nullptr);
  char* arguments[] = {const_cast<char*>(STANCE_HELD_CLIENT_BINARY),
                       const_cast<char*>(server->address().c_str()), nullptr};
  // One client dies while its call runs, one while its call waits.
  pid_t clients[2];
  for (pid_t& client : clients) {
    ASSERT_EQ(posix_spawn(&client, arguments[0], nullptr, nullptr, arguments, environ), 0);
    server->AwaitMetric(&client == &clients[0] ? kRunning : kQueued, 1);
  }
  for (const pid_t client : clients) {
    kill(client, SIGKILL);
    waitpid(client, nullptr, 0);
  }
  EXPECT_TRUE(Call(ChannelTo(*server), SmallRequest()).status.ok());
  server->AwaitMetric("stance_requests_total{code=\"CANCELLED\",rpc=\"Transfer\"}", 2);
  EXPECT_EQ(server->Metric("stance_requests_total{code=\"OK\",rpc=\"Transfer\"}"), 1);
}

// Calls that arrive while the worker is busy share a batch; a bad one among them does not touch the others,
// and each gets its own answer.
TEST(ServerTest, ABatchAnswersEachCallItsOwn) {
  auto server = MeasuredServer::Start({"--inference-workers", "1"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  std::vector<TriangleMesh> sources;
  std::vector<std::string> alone;
  for (int i = 0; i < 4; ++i) {
    sources.push_back(testing::Capsule(1.0f + 0.2f * static_cast<float>(i), 0.2f, 12 + 2 * i));
    const Answer answer = Call(channel, RequestOf(sources.back(), testing::Icosphere(2)));
    ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
    alone.push_back(answer.response.target().arrays().positions());
  }
  auto blocker = CallAsync(channel, LargeRequest());
  server->AwaitMetric(kRunning, 1);
  v1::TransferRequest bad = SmallRequest();
  bad.mutable_source()->mutable_arrays()->clear_indices();
  auto refused = CallAsync(channel, bad);
  std::vector<std::future<Answer>> together;
  for (const TriangleMesh& source : sources) {
    together.push_back(CallAsync(channel, RequestOf(source, testing::Icosphere(2))));
  }
  server->AwaitMetric(kQueued, 5);
  EXPECT_TRUE(blocker.get().status.ok());
  EXPECT_EQ(refused.get().status.error_code(), grpc::INVALID_ARGUMENT);
  for (size_t i = 0; i < together.size(); ++i) {
    const Answer answer = together[i].get();
    ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
    const std::string& positions = answer.response.target().arrays().positions();
    ASSERT_EQ(positions.size(), alone[i].size());
    for (size_t at = 0; at < positions.size(); at += sizeof(float)) {
      float in_batch, by_itself;
      std::memcpy(&in_batch, &positions[at], sizeof(float));
      std::memcpy(&by_itself, &alone[i][at], sizeof(float));
      ASSERT_NEAR(in_batch, by_itself, 1e-3) << "call " << i;
    }
  }
  EXPECT_EQ(server->Metric("stance_batch_requests_bucket{le=\"4\"}") + 1,
            server->Metric("stance_batch_requests_count"))
      << "the five calls did not share a batch";
}

TEST(ServerTest, HealthIsPerServiceAndWatchSeesTheDrain) {
  auto server = MeasuredServer::Start({"--server-lame-duck-seconds", "0.2"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  const auto health = grpc::health::v1::Health::NewStub(channel);
  for (const char* service : {"", "stance.v1.PoseTransferService", "stance.v1.ServerInfoService"}) {
    grpc::ClientContext context;
    grpc::health::v1::HealthCheckRequest request;
    request.set_service(service);
    grpc::health::v1::HealthCheckResponse response;
    ASSERT_TRUE(health->Check(&context, request, &response).ok()) << service;
    EXPECT_EQ(response.status(), grpc::health::v1::HealthCheckResponse::SERVING) << service;
  }
  {
    grpc::ClientContext context;
    grpc::health::v1::HealthCheckRequest request;
    request.set_service("stance.v1.Nothing");
    grpc::health::v1::HealthCheckResponse response;
    EXPECT_EQ(health->Check(&context, request, &response).error_code(), grpc::NOT_FOUND);
  }
  grpc::ClientContext context;
  grpc::health::v1::HealthCheckRequest request;
  request.set_service("stance.v1.PoseTransferService");
  const auto watch = health->Watch(&context, request);
  grpc::health::v1::HealthCheckResponse response;
  ASSERT_TRUE(watch->Read(&response));
  EXPECT_EQ(response.status(), grpc::health::v1::HealthCheckResponse::SERVING);
  server->Signal(SIGTERM);
  ASSERT_TRUE(watch->Read(&response));
  EXPECT_EQ(response.status(), grpc::health::v1::HealthCheckResponse::NOT_SERVING);
  // An open watch does not keep the server from ending.
  EXPECT_EQ(server->Stop(), 0);
}

TEST(ServerTest, ASigtermLosesNothingThatWasAccepted) {
  auto server = MeasuredServer::Start({"--inference-workers", "1"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  std::vector<std::future<Answer>> accepted;
  accepted.push_back(CallAsync(channel, LargeRequest()));
  server->AwaitMetric(kRunning, 1);
  for (int i = 0; i < 6; ++i) accepted.push_back(CallAsync(channel, SmallRequest()));
  server->AwaitMetric(kQueued, 6);
  server->Signal(SIGTERM);
  for (auto& call : accepted) {
    const Answer answer = call.get();
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    EXPECT_FALSE(answer.response.target().arrays().positions().empty());
  }
  EXPECT_EQ(server->Stop(), 0) << server->Log();
  EXPECT_THAT(server->Log(), HasSubstr(R"("event":"stopped","complete":"true")"));
}

TEST(ServerTest, ADrainTimeoutGivesBackWhatWaitsAndEnds) {
  auto server = MeasuredServer::Start({"--inference-workers", "1", "--server-drain-timeout-seconds", "0"});
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  auto running = CallAsync(channel, LargeRequest());
  server->AwaitMetric(kRunning, 1);
  auto waiting = CallAsync(channel, SmallRequest());
  server->AwaitMetric(kQueued, 1);
  server->Signal(SIGTERM);
  const Answer given_back = waiting.get();
  EXPECT_EQ(given_back.status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(given_back.status), "SHUTTING_DOWN");
  EXPECT_EQ(given_back.pushback, "1000");
  EXPECT_TRUE(running.get().status.ok());
  EXPECT_EQ(server->Stop(), 1);
}

TEST(ServerTest, DescribesItself) {
  auto server = MeasuredServer::Start({"--limits-max-vertices", "5000"});
  ASSERT_NE(server, nullptr);
  v1::GetServerInfoResponse info;
  grpc::ClientContext context;
  const auto stub = v1::ServerInfoService::NewStub(ChannelTo(*server));
  ASSERT_TRUE(stub->GetServerInfo(&context, v1::GetServerInfoRequest(), &info).ok());
  EXPECT_FALSE(info.version().empty());
  ASSERT_EQ(info.models_size(), 1);
  EXPECT_EQ(info.models(0).joint_count(), 24u);
  EXPECT_EQ(info.models(0).parameter_count(), 3377691u);
  EXPECT_EQ(info.limits().max_vertices(), 5000u);
  EXPECT_EQ(info.limits().max_message_bytes(), 256u << 20);
  EXPECT_THAT(info.methods(), ElementsAre(v1::METHOD_SKELETAL));
  EXPECT_EQ(info.formats_size(), 5);
}

// Asks grpc.reflection.v1alpha for the list of services, with the request's bytes written out: field 7
// (list_services), length 1, "*".
TEST(ServerTest, ReflectionListsTheServices) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  grpc::GenericStub stub(ChannelTo(*server));
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  auto call =
      stub.PrepareCall(&context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  void* tag = nullptr;
  bool ok = false;
  call->StartCall(nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
  grpc::Slice request_bytes("\x3a\x01*");
  call->Write(grpc::ByteBuffer(&request_bytes, 1), nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
  grpc::ByteBuffer response;
  call->Read(&response, nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
  std::vector<grpc::Slice> slices;
  ASSERT_TRUE(response.Dump(&slices).ok());
  std::string text;
  for (const grpc::Slice& slice : slices)
    text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  EXPECT_THAT(text, HasSubstr("stance.v1.PoseTransferService"));
  EXPECT_THAT(text, HasSubstr("stance.v1.ServerInfoService"));
  EXPECT_THAT(text, HasSubstr("grpc.health.v1.Health"));
  context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok));
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
}

TEST(ServerTest, MetricsCountRequestsAndPhases) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  const auto channel = ChannelTo(*server);
  ASSERT_TRUE(Call(channel, SmallRequest()).status.ok());
  v1::TransferRequest bad = SmallRequest();
  bad.mutable_options()->set_max_influences(99);
  ASSERT_FALSE(Call(channel, bad).status.ok());
  EXPECT_EQ(server->Metric("stance_requests_total{code=\"OK\",rpc=\"Transfer\"}"), 1);
  EXPECT_EQ(server->Metric("stance_requests_total{code=\"INVALID_ARGUMENT\",rpc=\"Transfer\"}"), 1);
  EXPECT_EQ(server->Metric("stance_request_seconds_count{rpc=\"Transfer\"}"), 2);
  EXPECT_EQ(server->Metric("stance_rejections_total{reason=\"INVALID_OPTION\"}"), 1);
  for (const char* phase :
       {"queue", "decode", "check", "resample", "network", "pose", "weights", "deform", "encode"}) {
    EXPECT_EQ(server->Metric("stance_phase_seconds_count{phase=\"" + std::string(phase) + "\"}"), 1) << phase;
  }
  EXPECT_EQ(server->Metric("stance_batch_requests_count"), 1);
  EXPECT_EQ(server->Metric(kQueued), 0);
}

TEST(ServerTest, LogsJson) {
  auto server = MeasuredServer::Start({"--metrics-listen", ""});
  ASSERT_NE(server, nullptr);
  v1::TransferRequest request = SmallRequest();
  request.set_request_id("a \"quoted\" id");
  ASSERT_TRUE(Call(ChannelTo(*server), request).status.ok());
  EXPECT_THAT(server->Log(),
              HasSubstr(R"("event":"request","request_id":"a \"quoted\" id","rpc":"Transfer","code":"OK")"));
}

TEST(ServerConfigTest, AnUnknownKeyIsRefusedByName) {
  const std::string path = ::testing::TempDir() + "/stance-unknown-key.toml";
  std::ofstream(path) << "[server]\nlistem = \"127.0.0.1:0\"\n";
  const auto finished = RunProgram({STANCE_SERVER_BINARY, "--config", path});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_THAT(finished.err, HasSubstr("server.listem: unknown option"));
  const auto flag = RunProgram({STANCE_SERVER_BINARY, "--listem", "x"});
  EXPECT_EQ(flag.exit_code, 2);
  EXPECT_THAT(flag.err, HasSubstr("--listem"));
}

TEST(ServerConfigTest, TheShippedFileIsAccepted) {
  const auto finished = RunProgram({STANCE_SERVER_BINARY, "--config", STANCE_SHIPPED_CONFIG, "--model",
                                    "/nowhere", "--log-format", "text"});
  EXPECT_EQ(finished.exit_code, 1);
  EXPECT_THAT(finished.err, HasSubstr("model.directory"));
}

// The shipped model and another, from a folder that holds both.
TEST(ServerConfigTest, AFolderOfModelsIsServed) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "stance-models";
  fs::remove_all(folder);
  fs::create_directories(folder);
  fs::copy(STANCE_SHIPPED_MODELS "/skeletal-human24", folder / "skeletal-human24");
  fs::copy(STANCE_UNTRAINED_STANCE_MODEL, folder / "stance");
  std::ofstream(folder / "server.toml") << "[model]\ndirectory = \"" << folder.string() << "\"\n";
  {
    BackgroundProgram server({STANCE_SERVER_BINARY, "--config", folder / "server.toml", "--listen",
                              "127.0.0.1:0", "--metrics-listen", "", "--server-lame-duck-seconds", "0"},
                             folder / "log");
    EXPECT_TRUE(server.ReadLine().starts_with("listening on "));
    server.Signal(SIGTERM);
    EXPECT_EQ(server.Wait(), 0);
  }
  std::ifstream log(folder / "log");
  const std::string text{std::istreambuf_iterator<char>(log), {}};
  EXPECT_THAT(text, HasSubstr(R"("models":"untrained-stance, skeletal-human24")"));
  fs::copy(STANCE_UNTRAINED_MODEL, folder / "another");
  const auto refused = RunProgram({STANCE_SERVER_BINARY, "--model", folder, "--log-format", "text"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("model.directory"));
  EXPECT_THAT(refused.err, HasSubstr("a second model of the method 'skeletal'"));
  fs::remove_all(folder);
}

TEST(ServerConfigTest, ATakenPortIsRefused) {
  auto server = MeasuredServer::Start();
  ASSERT_NE(server, nullptr);
  const auto finished = RunProgram({STANCE_SERVER_BINARY, "--model", STANCE_UNTRAINED_MODEL, "--listen",
                                    server->address(), "--metrics-listen", "", "--log-format", "text"});
  EXPECT_EQ(finished.exit_code, 1);
  EXPECT_THAT(finished.err, HasSubstr("server.listen"));
}

TEST(ServerConfigTest, SaysItsVersion) {
  const auto finished = RunProgram({STANCE_SERVER_BINARY, "--version"});
  EXPECT_EQ(finished.exit_code, 0);
  EXPECT_THAT(finished.out, HasSubstr("stance-server "));
}

}  // namespace
}  // namespace stance
