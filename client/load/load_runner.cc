#include "client/load/load_runner.h"

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/support/async_unary_call.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "stance/v1/pose_transfer.grpc.pb.h"

namespace stance {
namespace {

using Clock = std::chrono::steady_clock;

std::string CodeName(const grpc::Status& status) {
  return absl::StatusCodeToString(static_cast<absl::StatusCode>(status.error_code()));
}

void Prepare(std::chrono::duration<double> timeout, const std::string& token, grpc::ClientContext* context) {
  context->set_deadline(std::chrono::system_clock::now() +
                        std::chrono::duration_cast<std::chrono::system_clock::duration>(timeout));
  AddToken(token, context);
}

// One request in flight: the tag of its completion.
struct Call {
  grpc::ClientContext context;
  v1::TransferResponse response;
  grpc::Status status;
  std::unique_ptr<grpc::ClientAsyncResponseReader<v1::TransferResponse>> reader;
  double planned = 0;
  double sent = 0;
};

// One thread runs the plan and sends, another records the answers. A completion queue of our own rather than
// gRPC's callbacks: when it has been drained no thread of gRPC holds anything of a call any more, and the
// program may end.
class Runner {
 public:
  Runner(v1::PoseTransferService::Stub* stub, const std::string& token, const v1::TransferRequest* request,
         const LoadOptions& options)
      : stub_(stub), token_(token), request_(request), timeout_(options.timeout), plan_(options.plan) {}

  LoadReport Run() {
    std::thread receiver([this] { Receive(); });
    {
      std::unique_lock lock(mutex_);
      SendAll(lock);
      answered_.wait(lock, [this] { return in_flight_ == 0; });
    }
    report_.seconds = Now();
    queue_.Shutdown();
    receiver.join();
    report_.sent = plan_.sent();
    report_.unsent = plan_.unsent();
    report_.planned = report_.sent + report_.unsent;
    return std::move(report_);
  }

 private:
  double Now() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  // REQUIRES: `lock` holds mutex_.
  void SendAll(std::unique_lock<std::mutex>& lock) {
    for (;;) {
      const LoadStep step = plan_.Next(Now(), in_flight_);
      switch (step.kind) {
        case LoadStep::Kind::kFinished:
          return;
        case LoadStep::Kind::kSend:
          ++in_flight_;
          lock.unlock();
          Send(step.time);
          lock.lock();
          break;
        case LoadStep::Kind::kWaitUntil:
          answered_.wait_until(lock, start_ + std::chrono::duration_cast<Clock::duration>(
                                                  std::chrono::duration<double>(step.time)));
          break;
        case LoadStep::Kind::kWaitForAnswer:
          answered_.wait(lock);
          break;
      }
    }
  }

  void Send(double planned) {
    auto* call = new Call;  // Receive deletes it
    call->planned = planned;
    call->sent = Now();
    Prepare(timeout_, token_, &call->context);
    call->reader = stub_->PrepareAsyncTransfer(&call->context, *request_, &queue_);
    call->reader->StartCall();
    call->reader->Finish(&call->response, &call->status, call);
  }

  void Receive() {
    void* tag = nullptr;
    for (bool ok = false; queue_.Next(&tag, &ok);) {
      const double now = Now();
      const std::unique_ptr<Call> call(static_cast<Call*>(tag));
      const std::lock_guard lock(mutex_);
      report_.Record(call->planned, call->sent, now, CodeName(call->status));
      --in_flight_;
      answered_.notify_one();
    }
  }

  v1::PoseTransferService::Stub* const stub_;
  const std::string token_;
  const v1::TransferRequest* const request_;
  const std::chrono::duration<double> timeout_;
  const Clock::time_point start_ = Clock::now();
  grpc::CompletionQueue queue_;

  std::mutex mutex_;
  std::condition_variable answered_;
  LoadPlan plan_;          // guarded by mutex_ until the receiver has ended
  LoadReport report_;      // as is this
  int64_t in_flight_ = 0;  // guarded by mutex_
};

}  // namespace

absl::StatusOr<LoadReport> RunLoad(const ClientOptions& client, const v1::TransferRequest& request,
                                   const LoadOptions& options) {
  STANCE_ASSIGN_OR_RETURN(const std::shared_ptr<grpc::Channel> channel, ConnectChannel(client));
  const std::unique_ptr<v1::PoseTransferService::Stub> stub = v1::PoseTransferService::NewStub(channel);
  for (int i = 0; i < options.warmup; ++i) {
    grpc::ClientContext context;
    Prepare(options.timeout, client.token, &context);
    v1::TransferResponse response;
    const grpc::Status status = stub->Transfer(&context, request, &response);
    if (!status.ok()) return FromGrpcStatus(status);
  }
  LoadReport report = Runner(stub.get(), client.token, &request, options).Run();
  report.mode = options.plan.rate > 0 ? "open" : "closed";
  report.rate = options.plan.rate;
  report.clients = options.plan.max_in_flight;
  return report;
}

}  // namespace stance
