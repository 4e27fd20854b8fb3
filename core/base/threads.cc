#include "core/base/threads.h"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <thread>
#include <vector>

#include "core/base/cgroup.h"

namespace stance {

int CpuQuota() {
  double cpus = std::max(1u, std::thread::hardware_concurrency());
  cpu_set_t mask;
  if (sched_getaffinity(0, sizeof(mask), &mask) == 0) cpus = std::min<double>(cpus, CPU_COUNT(&mask));
  if (const auto quota = CgroupCpus()) cpus = std::min(cpus, std::ceil(*quota));
  return std::max(1, static_cast<int>(cpus));
}

void ParallelFor(int64_t count, int threads, int64_t grain,
                 const std::function<void(int64_t, int64_t)>& body) {
  if (count <= 0) return;
  const int64_t ranges = std::clamp<int64_t>(count / std::max<int64_t>(1, grain), 1, std::max(1, threads));
  std::vector<std::exception_ptr> failures(ranges);
  const auto run = [&](int64_t i) {
    try {
      body(count * i / ranges, count * (i + 1) / ranges);
    } catch (...) {
      failures[i] = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    helpers.reserve(ranges - 1);
    for (int64_t i = 1; i < ranges; ++i) helpers.emplace_back(run, i);
    run(0);
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace stance
