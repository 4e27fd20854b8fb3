// When a load generator sends: a pure state machine without threads, sockets or clock.
#pragma once

#include <cstdint>

#include "core/base/random.h"

namespace stance {

struct LoadPlanOptions {
  // Requests per second of an open loop with Poisson arrivals. 0: a closed loop.
  double rate = 0;
  // Most requests in flight. Closed loop: exactly so many clients, each sending its next request when its
  // last is answered. Open loop: a bound on the generator's own memory; a planned request waits for room, and
  // its latency counts from its planned time all the same.
  int64_t max_in_flight = 1;
  // Nothing is planned or sent after so many seconds. 0: no limit.
  double duration = 0;
  // Nothing is planned after so many requests. 0: no limit. One of the two limits must be set.
  int64_t requests = 0;
  uint64_t seed = 1;
};

struct LoadStep {
  enum class Kind {
    kSend,       // now, the request planned for `time`
    kWaitUntil,  // `time`, or an answer if that comes first
    kWaitForAnswer,
    kFinished,  // nothing more will be sent
  };
  Kind kind = Kind::kFinished;
  double time = 0;  // seconds since the start
};

// An open loop does not slow down with the server, so that a slow answer delays nobody's planned time; a
// closed loop plans each request for the moment at which it can be sent. Invariants: (1) planned times
// ascend; (2) in_flight <= max_in_flight; (3) the planned times of an open loop depend on rate and seed only.
class LoadPlan {
 public:
  explicit LoadPlan(const LoadPlanOptions& options);

  // What to do at `now` seconds since the start with `in_flight` requests unanswered. REQUIRES: `now` never
  // goes back. After kSend the caller has sent.
  LoadStep Next(double now, int64_t in_flight);

  // Planned requests that could not be sent before the duration was over. Final after kFinished.
  int64_t unsent() const { return unsent_; }
  int64_t sent() const { return sent_; }

 private:
  void PlanNext();

  const LoadPlanOptions options_;
  Random random_;
  double planned_ = 0;  // the next request of an open loop
  int64_t sent_ = 0;
  int64_t unsent_ = 0;
  bool finished_ = false;
};

}  // namespace stance
