// One Animate stream from its first message to its end.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include "server/animate_calls.h"
#include "server/open_streams.h"
#include "stance/v1/pose_transfer.pb.h"

namespace stance {

// A reactor that owns itself: OnDone deletes it. It rigs the source as one piece of work and each reference
// as another, by the same queue as every other call, and never waits.
//
// Invariants: (1) references are answered in the order in which they were read; (2) at most kMostReferences
// are read and not yet written, so that a slow reader or a busy server stops the reading; (3) none is read
// before the source is rigged, nor after the stream's end is decided; (4) it ends when all that were read are
// written or, once the caller is gone, given up.
class AnimateStream final : public grpc::ServerBidiReactor<v1::AnimateRequest, v1::AnimateResponse>,
                            public AnimateOwner,
                            public DrainListener {
 public:
  static constexpr int kMostReferences = 8;

  // What it is given outlives it.
  AnimateStream(const Serving& serving, const Catalog& catalog, grpc::CallbackServerContext* context);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  struct Reference {
    std::unique_ptr<ReferenceCall> call;
    bool answered = false;
  };

  ~AnimateStream() override = default;

  void SourceAnswered(const absl::Status& status) override;
  void ReferenceAnswered(uint64_t index) override;
  void OnDrain() override;

  // Take the message just read, and return the call to begin without the lock: it may answer at once.
  Call* TakeStartLocked();
  Call* TakeReferenceLocked();
  // The first reason counts.
  void EndLocked(const absl::Status& status);
  // Reads, writes and finishes, as far as it is time to.
  void StepLocked();

  const Serving& serving_;
  const Catalog& catalog_;
  grpc::CallbackServerContext* const context_;
  const TimePoint arrival_;
  const TraceContext span_;
  const bool counted_;  // in serving_.active

  std::mutex mutex_;
  // Protected by mutex_, except what a call under way uses of source_:
  v1::AnimateRequest message_;
  AnimateSource source_;
  std::unique_ptr<SourceCall> source_call_;  // null before the first message
  std::deque<Reference> references_;         // read and not yet written, the oldest first
  uint64_t written_ = 0;                     // the index of references_.front()
  bool rigging_ = false;
  bool reading_ = false;  // or about to begin what was read
  bool writing_ = false;
  bool cancelled_ = false;
  bool finishing_ = false;
  std::optional<absl::Status> end_;  // why nothing more is read
};

}  // namespace stance
