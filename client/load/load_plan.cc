#include "client/load/load_plan.h"

#include <cmath>
#include <limits>

#include "core/base/check.h"

namespace stance {
namespace {

LoadPlanOptions WithoutZeros(LoadPlanOptions options) {
  STANCE_CHECK(options.duration > 0 || options.requests > 0);
  STANCE_CHECK(options.rate >= 0 && options.max_in_flight > 0);
  if (options.duration <= 0) options.duration = std::numeric_limits<double>::infinity();
  if (options.requests <= 0) options.requests = std::numeric_limits<int64_t>::max();
  return options;
}

}  // namespace

LoadPlan::LoadPlan(const LoadPlanOptions& options) : options_(WithoutZeros(options)), random_(options.seed) {
  if (options_.rate > 0) PlanNext();
}

// The gaps of a Poisson process are exponential with mean 1 / rate.
void LoadPlan::PlanNext() { planned_ += -std::log1p(-random_.Uniform()) / options_.rate; }

LoadStep LoadPlan::Next(double now, int64_t in_flight) {
  using Kind = LoadStep::Kind;
  const bool open = options_.rate > 0;
  if (!finished_ && now >= options_.duration) {
    // What was planned within the duration and still waits for room is the load that the server refused.
    while (open && planned_ < options_.duration && sent_ + unsent_ < options_.requests) {
      ++unsent_;
      PlanNext();
    }
    finished_ = true;
  }
  finished_ = finished_ || sent_ >= options_.requests || (open && planned_ >= options_.duration);
  if (finished_) return {.kind = Kind::kFinished};
  if (open && now < planned_) return {.kind = Kind::kWaitUntil, .time = planned_};
  if (in_flight >= options_.max_in_flight) {
    if (!std::isfinite(options_.duration)) return {.kind = Kind::kWaitForAnswer};
    return {.kind = Kind::kWaitUntil, .time = options_.duration};
  }
  const LoadStep step = {.kind = Kind::kSend, .time = open ? planned_ : now};
  ++sent_;
  if (open) PlanNext();
  return step;
}

}  // namespace stance
