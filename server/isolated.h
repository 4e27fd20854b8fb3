// A batch whose bad member must not fail the others.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "server/guarded.h"

namespace stance {

// The results of `run_all` on the jobs, one each, in order. Where it throws, or answers a job with an error
// that is not the job's own (INTERNAL, RESOURCE_EXHAUSTED, UNKNOWN: a network that refused the batch, memory
// that was too little for all of it), those jobs are run again one by one, so that only the one at fault
// fails. `what` as in Guarded.
template <typename Result, typename Job, typename RunAll>
std::vector<absl::StatusOr<Result>> RunIsolated(const char* what, std::span<const Job> jobs,
                                                const RunAll& run_all) {
  using Results = std::vector<absl::StatusOr<Result>>;
  const auto run = [&](std::span<const Job> some) {
    Results results;
    const absl::Status ran = Guarded(what, [&] {
      results = run_all(some);
      return absl::OkStatus();
    });
    if (!ran.ok()) results.assign(some.size(), ran);
    return results;
  };
  const auto may_be_a_neighbours = [](const absl::Status& status) {
    return status.code() == absl::StatusCode::kInternal || status.code() == absl::StatusCode::kUnknown ||
           status.code() == absl::StatusCode::kResourceExhausted;
  };
  Results results = run(jobs);
  if (jobs.size() == 1) return results;
  for (size_t i = 0; i < jobs.size(); ++i) {
    if (may_be_a_neighbours(results[i].status())) results[i] = std::move(run(jobs.subspan(i, 1))[0]);
  }
  return results;
}

}  // namespace stance
