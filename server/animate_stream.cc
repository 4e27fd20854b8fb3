#include "server/animate_stream.h"

#include <utility>

#include "server/call_metadata.h"
#include "server/log.h"
#include "server/status_map.h"

namespace stance {
namespace {

absl::Status BadMessage(const char* field, const char* description) {
  return FieldError(absl::StatusCode::kInvalidArgument, "INVALID_STREAM", field, description);
}

}  // namespace

AnimateStream::AnimateStream(const Serving& serving, const Catalog& catalog,
                             grpc::CallbackServerContext* context)
    : serving_(serving),
      catalog_(catalog),
      context_(context),
      arrival_(serving.clock.Now()),
      span_(BeginSpan(*context)),
      counted_(serving.active.Enter()) {
  const bool open = counted_ && serving_.streams.Add(this);
  std::lock_guard<std::mutex> guard(mutex_);
  if (!open) EndLocked(ShuttingDownError());
  StepLocked();
}

void AnimateStream::OnReadDone(bool ok) {
  Call* call = nullptr;
  {
    std::lock_guard<std::mutex> guard(mutex_);
    if (!ok) {
      EndLocked(source_call_ == nullptr ? BadMessage("start", "is required") : absl::OkStatus());
    } else if (!end_) {
      call = source_call_ == nullptr ? TakeStartLocked() : TakeReferenceLocked();
    }
  }
  // Before the next one is read, so that they queue in their order.
  if (call != nullptr) call->Begin();
  std::lock_guard<std::mutex> guard(mutex_);
  reading_ = false;
  StepLocked();
}

Call* AnimateStream::TakeStartLocked() {
  if (!message_.has_start()) {
    EndLocked(BadMessage("start", "is required in the first message"));
    return nullptr;
  }
  source_.start = std::move(*message_.mutable_start());
  source_call_ = std::make_unique<SourceCall>(context_, serving_, catalog_, source_, *this);
  rigging_ = true;
  return source_call_.get();
}

Call* AnimateStream::TakeReferenceLocked() {
  if (!message_.has_reference()) {
    EndLocked(BadMessage("reference", "is required in every message but the first"));
    return nullptr;
  }
  const uint64_t index = written_ + references_.size();
  references_.push_back({std::make_unique<ReferenceCall>(context_, serving_, catalog_, source_, index,
                                                         std::move(*message_.mutable_reference()), *this)});
  return references_.back().call.get();
}

void AnimateStream::SourceAnswered(const absl::Status& status) {
  std::lock_guard<std::mutex> guard(mutex_);
  rigging_ = false;
  if (!status.ok()) EndLocked(status);
  StepLocked();
}

void AnimateStream::ReferenceAnswered(uint64_t index) {
  std::lock_guard<std::mutex> guard(mutex_);
  references_[index - written_].answered = true;
  StepLocked();
}

void AnimateStream::OnWriteDone(bool ok) {
  std::lock_guard<std::mutex> guard(mutex_);
  writing_ = false;
  references_.pop_front();
  ++written_;
  if (!ok) cancelled_ = true;  // OnCancel follows
  StepLocked();
}

void AnimateStream::OnCancel() {
  {
    std::lock_guard<std::mutex> guard(mutex_);
    cancelled_ = true;
    EndLocked(WithReason(absl::CancelledError("the caller gave the stream up"), "CANCELLED"));
    if (source_call_ != nullptr) source_call_->MarkCancelled();
    for (const Reference& reference : references_) reference.call->MarkCancelled();
  }
  // Without the lock: it answers those that wait.
  serving_.runner.SweepCancelled();
  std::lock_guard<std::mutex> guard(mutex_);
  StepLocked();
}

void AnimateStream::OnDrain() {
  std::lock_guard<std::mutex> guard(mutex_);
  EndLocked(ShuttingDownError());
  StepLocked();
}

void AnimateStream::OnDone() {
  serving_.streams.Remove(this);
  { std::lock_guard<std::mutex> guard(mutex_); }  // whoever has finished the stream has let go of it
  ActiveCalls& active = serving_.active;
  const bool counted = counted_;
  delete this;
  if (counted) active.Leave();
}

void AnimateStream::EndLocked(const absl::Status& status) {
  if (!end_) end_ = status;
}

void AnimateStream::StepLocked() {
  if (finishing_) return;
  while (cancelled_ && !writing_ && !references_.empty() && references_.front().answered) {
    references_.pop_front();
    ++written_;
  }
  if (!writing_ && !references_.empty() && references_.front().answered) {
    writing_ = true;
    StartWrite(&references_.front().call->response());
  }
  if (!end_ && !reading_ && !rigging_ && std::ssize(references_) < kMostReferences) {
    reading_ = true;
    StartRead(&message_);
  }
  if (!end_ || rigging_ || !references_.empty()) return;
  finishing_ = true;
  Log(LogLevel::kInfo, "stream",
      {{"rpc", std::string("Animate")},
       {"code", end_->ok() ? std::string("OK") : absl::StatusCodeToString(end_->code())},
       {"reason", ReasonOf(*end_)},
       {"references", static_cast<int64_t>(written_)},
       {"total_seconds", ToSeconds(serving_.clock.Now() - arrival_)},
       {"trace_id", span_.trace_id},
       {"span_id", span_.span_id},
       {"parent_span_id", span_.parent_id}});
  AddAnswerMetadata(*context_, span_, *end_);
  Finish(ToGrpcStatus(*end_));
}

}  // namespace stance
