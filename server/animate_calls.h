// The pieces of work that an Animate stream consists of.
#pragma once

#include <memory>
#include <string>

#include "core/transfer/pipeline.h"
#include "server/call.h"
#include "server/convert.h"
#include "server/pose_transfer_calls.h"
#include "stance/v1/pose_transfer.pb.h"

namespace stance {

// What the references of a stream have in common: filled by the source's call, fixed once that is answered.
struct AnimateSource {
  v1::AnimateStart start;  // without its mesh, once that is read
  v1::UpAxis up_axis = v1::UP_AXIS_UNSPECIFIED;
  TransferPlan plan;
  TriangleMesh mesh;
  std::shared_ptr<const RiggedSource> rigged;
};

// Whom the calls of a stream answer; it owns them, and may delete a call that has answered.
class AnimateOwner {
 public:
  virtual void SourceAnswered(const absl::Status& status) = 0;
  virtual void ReferenceAnswered(uint64_t index) = 0;

 protected:
  ~AnimateOwner() = default;
};

// Rigs the stream's source. What it refers to outlives it, as it does below.
class SourceCall final : public Call {
 public:
  using Job = RigJob;
  using Result = RigSourceResult;

  SourceCall(grpc::CallbackServerContext* context, const Serving& serving, const Catalog& catalog,
             AnimateSource& source, AnimateOwner& owner);

  absl::Status Decode();
  Job MakeJob() const {
    return {&source_.mesh, source_.plan.options, [this] { return is_cancelled(); }};
  }
  absl::Status Encode(const Result& result);

 private:
  absl::Status Plan() override;
  const std::string& RequestedId() const override { return source_.start.request_id(); }
  int64_t Vertices() const override { return vertices_; }
  int64_t RequestBytes() const override { return bytes_; }
  Priority RequestedPriority() const override { return source_.plan.priority; }
  // Rigging a source is all that Rig does.
  int CostKind() const override { return CostKindOf(Rpc::kRig, source_.plan.options); }
  void FinishResponse(const std::string&, const ServerSeconds&) override {}
  void Send(const absl::Status& status) override { owner_.SourceAnswered(status); }

  const Catalog& catalog_;
  AnimateSource& source_;
  AnimateOwner& owner_;
  const int64_t vertices_;
  const int64_t bytes_;
};

// Transfers one reference's pose to the source.
class ReferenceCall final : public TransferWork {
 public:
  // REQUIRES: the source has been rigged.
  ReferenceCall(grpc::CallbackServerContext* context, const Serving& serving, const Catalog& catalog,
                const AnimateSource& source, uint64_t index, v1::AnimateReference reference,
                AnimateOwner& owner);

  // Complete once it has answered.
  const v1::AnimateResponse& response() const { return response_; }

  absl::Status Decode() override;
  Job MakeJob() const override;
  absl::Status Encode(const Result& result) override;

 private:
  absl::Status Plan() override;
  const std::string& RequestedId() const override { return reference_.request_id(); }
  int64_t Vertices() const override { return vertices_; }
  int64_t RequestBytes() const override { return bytes_; }
  Priority RequestedPriority() const override { return source_.plan.priority; }
  int CostKind() const override { return CostKindOf(Rpc::kAnimate, source_.plan.options); }
  void FinishResponse(const std::string& request_id, const ServerSeconds& seconds) override;
  void Send(const absl::Status& status) override;

  const Catalog& catalog_;
  const AnimateSource& source_;
  AnimateOwner& owner_;
  const uint64_t index_;
  v1::AnimateReference reference_;  // without its mesh, once that is read
  const int64_t vertices_;
  const int64_t bytes_;
  UpAxis up_ = UpAxis::kY;
  TriangleMesh mesh_;
  v1::AnimateResponse response_;
};

}  // namespace stance
