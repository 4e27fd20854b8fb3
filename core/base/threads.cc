#include "core/base/threads.h"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

namespace stance {
namespace {

// The cgroup's quota in CPUs, or a number no machine reaches where there is none.
double CgroupCpus() {
  constexpr double kNone = 1e9;
  if (std::ifstream v2("/sys/fs/cgroup/cpu.max"); v2) {
    std::string quota;
    double period = 0;
    if (v2 >> quota >> period && quota != "max" && period > 0) return std::atof(quota.c_str()) / period;
    return kNone;
  }
  std::ifstream quota_file("/sys/fs/cgroup/cpu/cpu.cfs_quota_us");
  std::ifstream period_file("/sys/fs/cgroup/cpu/cpu.cfs_period_us");
  double quota = 0, period = 0;
  if (quota_file >> quota && period_file >> period && quota > 0 && period > 0) return quota / period;
  return kNone;
}

}  // namespace

int CpuQuota() {
  double cpus = std::max(1u, std::thread::hardware_concurrency());
  cpu_set_t mask;
  if (sched_getaffinity(0, sizeof(mask), &mask) == 0) cpus = std::min<double>(cpus, CPU_COUNT(&mask));
  cpus = std::min(cpus, std::ceil(CgroupCpus()));
  return std::max(1, static_cast<int>(cpus));
}

void ParallelFor(int64_t count, int threads, int64_t grain,
                 const std::function<void(int64_t, int64_t)>& body) {
  if (count <= 0) return;
  const int64_t ranges = std::clamp<int64_t>(count / std::max<int64_t>(1, grain), 1, std::max(1, threads));
  std::vector<std::jthread> helpers;
  helpers.reserve(ranges - 1);
  for (int64_t i = 1; i < ranges; ++i) {
    helpers.emplace_back(
        [&body, begin = count * i / ranges, end = count * (i + 1) / ranges] { body(begin, end); });
  }
  body(0, count / ranges);
}

}  // namespace stance
