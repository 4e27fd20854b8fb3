// Animate on the real server, over a raw gRPC stub.

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstring>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "proto/wire/mesh_wire.h"
#include "stance/v1/pose_transfer.grpc.pb.h"
#include "tests/integration/measured_server.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using testing::MeasuredServer;

constexpr char kQueued[] = "stance_queued_requests";
constexpr char kRunning[] = "stance_running_requests";
constexpr char kAnswered[] = "stance_requests_total{code=\"OK\",rpc=\"Animate\"}";

v1::Mesh WireMesh(const TriangleMesh& mesh) {
  v1::Mesh wire;
  MeshToArrays(mesh, wire.mutable_arrays());
  return wire;
}

TriangleMesh SourceMesh() { return testing::Icosphere(3); }
// The i-th of a row of poses, all different.
TriangleMesh Pose(int i) { return testing::Capsule(1.0f + 0.1f * static_cast<float>(i), 0.2f); }

v1::AnimateRequest Start(const TriangleMesh& source) {
  v1::AnimateRequest message;
  *message.mutable_start()->mutable_source() = WireMesh(source);
  message.mutable_start()->set_request_id("the-stream");
  return message;
}
v1::AnimateRequest Reference(const TriangleMesh& mesh, const std::string& id = "") {
  v1::AnimateRequest message;
  *message.mutable_reference()->mutable_reference() = WireMesh(mesh);
  message.mutable_reference()->set_request_id(id);
  return message;
}

template <typename Message>
Message DetailOf(const google::rpc::Status& status) {
  Message message;
  for (const auto& detail : status.details()) {
    if (detail.Is<Message>()) detail.UnpackTo(&message);
  }
  return message;
}
google::rpc::Status DetailsOf(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  return details;
}
std::string ReasonOf(const google::rpc::Status& status) {
  return DetailOf<google::rpc::ErrorInfo>(status).reason();
}
std::string FieldOf(const google::rpc::Status& status) {
  const auto bad_request = DetailOf<google::rpc::BadRequest>(status);
  return bad_request.field_violations_size() == 1 ? bad_request.field_violations(0).field() : "";
}

// A stream to a server of its own.
class AnimateTest : public ::testing::Test {
 protected:
  void StartServer(std::vector<std::string> arguments = {}) {
    arguments.insert(arguments.end(), {"--inference-workers", "1"});
    server_ = MeasuredServer::Start(arguments);
    ASSERT_NE(server_, nullptr);
    grpc::ChannelArguments channel;
    channel.SetMaxReceiveMessageSize(-1);
    stub_ = v1::PoseTransferService::NewStub(
        grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), channel));
  }
  void Open() {
    context_ = std::make_unique<grpc::ClientContext>();
    context_->set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(2));
    stream_ = stub_->Animate(context_.get());
  }
  // The source is rigged once this is back.
  void OpenAndReadOne() {
    Open();
    stream_->Write(Start(SourceMesh()));
    stream_->Write(Reference(Pose(0)));
    v1::AnimateResponse first;
    ASSERT_TRUE(stream_->Read(&first));
  }
  // Every answer to come, then the status.
  std::vector<v1::AnimateResponse> ReadAll(grpc::Status* status) {
    std::vector<v1::AnimateResponse> answers;
    for (v1::AnimateResponse answer; stream_->Read(&answer);) answers.push_back(answer);
    *status = stream_->Finish();
    return answers;
  }
  // The status of a stream of these messages.
  grpc::Status StatusOf(const std::vector<v1::AnimateRequest>& messages) {
    Open();
    for (const v1::AnimateRequest& message : messages) stream_->Write(message);
    stream_->WritesDone();
    grpc::Status status;
    EXPECT_THAT(ReadAll(&status), ::testing::IsEmpty());
    return status;
  }
  v1::TransferResponse Transfer(const TriangleMesh& source, const TriangleMesh& reference) {
    v1::TransferRequest request;
    *request.mutable_source() = WireMesh(source);
    *request.mutable_reference() = WireMesh(reference);
    v1::TransferResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub_->Transfer(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  // A large transfer that holds the only worker.
  std::future<void> Block() {
    // An answer arrives before its batch counts as done.
    while (server_->Metric(kRunning) > 0) std::this_thread::yield();
    auto blocker =
        std::async(std::launch::async, [this] { Transfer(testing::Icosphere(6), testing::Icosphere(6)); });
    server_->AwaitMetric(kRunning, 1);
    return blocker;
  }

  std::unique_ptr<MeasuredServer> server_;
  std::unique_ptr<v1::PoseTransferService::Stub> stub_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AnimateRequest, v1::AnimateResponse>> stream_;
};

void ExpectNear(const std::string& a, const std::string& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t at = 0; at < a.size(); at += sizeof(float)) {
    float one, two;
    std::memcpy(&one, &a[at], sizeof(float));
    std::memcpy(&two, &b[at], sizeof(float));
    ASSERT_NEAR(one, two, 1e-3);
  }
}

TEST_F(AnimateTest, AnswersEachReferenceInOrderAsTransferWould) {
  StartServer();
  Open();
  constexpr int kReferences = 20;  // more than are in flight at a time
  auto writer = std::async(std::launch::async, [&] {
    stream_->Write(Start(SourceMesh()));
    for (int i = 0; i < kReferences; ++i) stream_->Write(Reference(Pose(i), "pose-" + std::to_string(i)));
    stream_->WritesDone();
  });
  grpc::Status status;
  const auto answers = ReadAll(&status);
  writer.get();
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(answers.size(), size_t{kReferences});
  for (int i = 0; i < kReferences; ++i) {
    const v1::AnimateResponse& answer = answers[static_cast<size_t>(i)];
    EXPECT_EQ(answer.index(), static_cast<uint64_t>(i));
    EXPECT_EQ(answer.request_id(), "pose-" + std::to_string(i));
    ASSERT_TRUE(answer.has_transfer()) << answer.error().message();
    EXPECT_EQ(answer.transfer().request_id(), answer.request_id());
  }
  for (const int i : {0, 7, 19}) {
    ExpectNear(answers[static_cast<size_t>(i)].transfer().target().arrays().positions(),
               Transfer(SourceMesh(), Pose(i)).target().arrays().positions());
  }
  // Every reference, and the source.
  EXPECT_EQ(server_->Metric(kAnswered), kReferences + 1);
  EXPECT_THAT(server_->Log(), HasSubstr(R"("request_id":"pose-19")"));
}

TEST_F(AnimateTest, TheSourceIsRiggedOnceWhateverTheCacheHolds) {
  StartServer({"--inference-rig-cache-bytes", "100000000"});
  Open();
  stream_->Write(Start(SourceMesh()));
  v1::AnimateResponse answer;
  for (int i = 0; i < 3; ++i) {
    stream_->Write(Reference(Pose(i)));
    ASSERT_TRUE(stream_->Read(&answer));
    ASSERT_TRUE(answer.has_transfer()) << answer.error().message();
  }
  stream_->Write(Reference(Pose(0)));
  ASSERT_TRUE(stream_->Read(&answer));
  EXPECT_EQ(answer.transfer().timings().network_seconds(), 0);
  // Four meshes were rigged, one was known, and nobody asked for the source again.
  EXPECT_EQ(server_->Metric("stance_rig_cache_misses_total"), 4);
  EXPECT_EQ(server_->Metric("stance_rig_cache_hits_total"), 1);
}

TEST_F(AnimateTest, AnswersTheOutputsOfTheStart) {
  StartServer();
  Open();
  v1::AnimateRequest start = Start(SourceMesh());
  start.mutable_start()->mutable_source()->set_up_axis(v1::UP_AXIS_Z);
  start.mutable_start()->mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_TRANSFORMS);
  stream_->Write(start);
  stream_->Write(Reference(Pose(1)));
  stream_->WritesDone();
  grpc::Status status;
  const auto answers = ReadAll(&status);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].transfer().joint_transforms_size(), 24 * 12);
  EXPECT_FALSE(answers[0].transfer().has_target());
}

TEST_F(AnimateTest, ABadReferenceHasItsOwnErrorAndTheStreamGoesOn) {
  StartServer({"--limits-max-vertices", "5000"});
  Open();
  stream_->Write(Start(SourceMesh()));
  v1::AnimateRequest cut = Reference(Pose(0), "cut");
  cut.mutable_reference()->mutable_reference()->mutable_arrays()->mutable_positions()->pop_back();
  v1::AnimateRequest flat = Reference(Pose(0));
  std::string* positions =
      flat.mutable_reference()->mutable_reference()->mutable_arrays()->mutable_positions();
  positions->assign(positions->size(), '\0');
  v1::AnimateRequest missing, axis = Reference(Pose(0));
  missing.mutable_reference();
  axis.mutable_reference()->mutable_reference()->set_up_axis(v1::UpAxis(42));
  for (const auto& message : {cut, flat, missing, axis, Reference(testing::Icosphere(5)), Reference(Pose(0)),
                              Reference(Pose(0), "line\nbreak")}) {
    stream_->Write(message);
  }
  stream_->WritesDone();
  grpc::Status status;
  const auto answers = ReadAll(&status);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(answers.size(), 7u);
  EXPECT_EQ(answers[0].request_id(), "cut");
  const char* fields[] = {"reference.arrays.positions", "reference", "reference", "reference.up_axis",
                          "reference.arrays.positions"};
  for (size_t i = 0; i < 5; ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(answers[i].index(), i);
    EXPECT_EQ(answers[i].error().code(), grpc::INVALID_ARGUMENT);
    EXPECT_EQ(FieldOf(answers[i].error()), fields[i]) << answers[i].error().message();
  }
  EXPECT_TRUE(answers[5].has_transfer());
  EXPECT_EQ(ReasonOf(answers[6].error()), "INVALID_REQUEST_ID");
}

TEST_F(AnimateTest, ABadStartEndsTheStream) {
  StartServer();
  v1::AnimateRequest bad = Start(SourceMesh());
  bad.mutable_start()->mutable_source()->mutable_arrays()->clear_indices();
  grpc::Status status = StatusOf({bad, Reference(Pose(0))});
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT) << status.error_message();
  EXPECT_EQ(FieldOf(DetailsOf(status)), "source");
  bad = Start(SourceMesh());
  bad.mutable_start()->mutable_options()->set_model("nobody");
  status = StatusOf({bad});
  EXPECT_EQ(status.error_code(), grpc::NOT_FOUND);
  EXPECT_EQ(FieldOf(DetailsOf(status)), "options.model");
}

TEST_F(AnimateTest, MessagesOutOfTurnEndTheStream) {
  StartServer();
  for (const auto& messages :
       {std::vector<v1::AnimateRequest>{}, {Reference(Pose(0))}, {v1::AnimateRequest()}}) {
    const grpc::Status status = StatusOf(messages);
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
    EXPECT_EQ(FieldOf(DetailsOf(status)), "start");
    EXPECT_EQ(ReasonOf(DetailsOf(status)), "INVALID_STREAM");
  }
  const grpc::Status twice = StatusOf({Start(SourceMesh()), Start(SourceMesh())});
  EXPECT_EQ(twice.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(FieldOf(DetailsOf(twice)), "reference");
}

// While the worker is busy the stream reads eight references and no more, however many the caller writes.
TEST_F(AnimateTest, ABusyServerReadsNoFurtherThanItsWindow) {
  StartServer();
  ASSERT_NO_FATAL_FAILURE(OpenAndReadOne());
  auto blocker = Block();
  auto writer = std::async(std::launch::async, [&] {
    for (int i = 1; i < 40; ++i) stream_->Write(Reference(Pose(i)));
    stream_->WritesDone();
  });
  server_->AwaitMetric(kQueued, 8);
  auto other = std::async(std::launch::async, [&] { Transfer(SourceMesh(), Pose(0)); });
  server_->AwaitMetric(kQueued, 9);
  EXPECT_EQ(server_->Metric(kQueued), 9);
  grpc::Status status;
  EXPECT_EQ(ReadAll(&status).size(), 39u);
  EXPECT_TRUE(status.ok());
  writer.get();
  other.get();
  blocker.get();
}

// A caller that doesn't read is answered only as far as the window and the transport's buffers go.
TEST_F(AnimateTest, ASlowReaderStopsTheReading) {
  StartServer({"--inference-rig-cache-bytes", "100000000"});  // so that a reference costs little
  Open();
  v1::AnimateRequest start = Start(testing::Icosphere(5));
  // Answers of more than 0.3 MB each.
  start.mutable_start()->mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_TARGET);
  start.mutable_start()->mutable_options()->add_outputs(v1::TRANSFER_OUTPUT_WEIGHTS);
  stream_->Write(start);
  constexpr int kReferences = 60;
  auto writer = std::async(std::launch::async, [&] {
    for (int i = 0; i < kReferences; ++i) stream_->Write(Reference(Pose(0)));
    stream_->WritesDone();
  });
  server_->AwaitMetric(kAnswered, 1 + 8);
  // What another caller gets done meanwhile is time enough to run ahead.
  for (int i = 0; i < kReferences; ++i) Transfer(testing::Icosphere(5), Pose(0));
  EXPECT_LT(server_->Metric(kAnswered), kReferences / 2);
  grpc::Status status;
  EXPECT_EQ(ReadAll(&status).size(), size_t{kReferences});
  EXPECT_TRUE(status.ok()) << status.error_message();
  writer.get();
}

TEST_F(AnimateTest, ACancelledStreamLeavesTheQueue) {
  StartServer();
  ASSERT_NO_FATAL_FAILURE(OpenAndReadOne());
  auto blocker = Block();
  for (int i = 0; i < 5; ++i) stream_->Write(Reference(Pose(i)));
  server_->AwaitMetric(kQueued, 5);
  context_->TryCancel();
  server_->AwaitMetric("stance_requests_total{code=\"CANCELLED\",rpc=\"Animate\"}", 5);
  EXPECT_EQ(server_->Metric(kQueued), 0);
  grpc::Status status;
  EXPECT_TRUE(ReadAll(&status).empty());
  EXPECT_EQ(status.error_code(), grpc::CANCELLED);
  blocker.get();
}

TEST_F(AnimateTest, TheDeadlineIsTheStreams) {
  StartServer();
  ASSERT_NO_FATAL_FAILURE(OpenAndReadOne());
  context_->TryCancel();
  grpc::Status status;
  ReadAll(&status);
  auto blocker = Block();
  context_ = std::make_unique<grpc::ClientContext>();
  context_->set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(200));
  stream_ = stub_->Animate(context_.get());
  stream_->Write(Start(SourceMesh()));
  EXPECT_TRUE(ReadAll(&status).empty());
  EXPECT_EQ(status.error_code(), grpc::DEADLINE_EXCEEDED);
  blocker.get();
  EXPECT_EQ(server_->Metric("stance_late_starts_total"), 0);
}

TEST_F(AnimateTest, ADrainAnswersWhatWasReadAndEndsTheStream) {
  StartServer();
  ASSERT_NO_FATAL_FAILURE(OpenAndReadOne());
  auto blocker = Block();
  for (int i = 1; i < 6; ++i) stream_->Write(Reference(Pose(i)));
  server_->AwaitMetric(kQueued, 5);
  auto stopped = std::async(std::launch::async, [&] { return server_->Stop(); });
  grpc::Status status;
  const auto answers = ReadAll(&status);
  ASSERT_EQ(answers.size(), 5u);
  for (const auto& answer : answers) EXPECT_TRUE(answer.has_transfer()) << answer.error().message();
  EXPECT_EQ(status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(DetailsOf(status)), "SHUTTING_DOWN");
  blocker.get();
  EXPECT_EQ(stopped.get(), 0);
}

TEST_F(AnimateTest, AnIdleStreamEndsWithTheServer) {
  StartServer();
  Open();
  stream_->Write(Start(SourceMesh()));
  server_->AwaitMetric(kAnswered, 1);
  auto stopped = std::async(std::launch::async, [&] { return server_->Stop(); });
  grpc::Status status;
  EXPECT_TRUE(ReadAll(&status).empty());
  EXPECT_EQ(status.error_code(), grpc::UNAVAILABLE);
  EXPECT_EQ(stopped.get(), 0);
}

// Each reference counts against its client's bounds as a call of its own, and is refused alone.
TEST_F(AnimateTest, AReferenceBeyondAQuotaIsRefusedAlone) {
  StartServer({"--batching-max-queued-requests-per-client", "2"});
  ASSERT_NO_FATAL_FAILURE(OpenAndReadOne());
  auto blocker = Block();
  for (int i = 0; i < 4; ++i) stream_->Write(Reference(Pose(i)));
  stream_->WritesDone();
  grpc::Status status;
  const auto answers = ReadAll(&status);
  EXPECT_TRUE(status.ok());
  ASSERT_EQ(answers.size(), 4u);
  EXPECT_TRUE(answers[0].has_transfer() && answers[1].has_transfer());
  for (const size_t i : {2, 3}) {
    EXPECT_EQ(answers[i].error().code(), grpc::RESOURCE_EXHAUSTED);
    EXPECT_EQ(ReasonOf(answers[i].error()), "CLIENT_QUOTA");
    EXPECT_EQ(DetailOf<google::rpc::RetryInfo>(answers[i].error()).retry_delay().nanos(), 250'000'000);
  }
  blocker.get();
}

}  // namespace
}  // namespace stance
