// How many threads this process may use, and a loop that uses them.
#pragma once

#include <cstdint>
#include <functional>

namespace stance {

// CPUs this process may use: the smallest of the hardware's count, the affinity mask, and the cgroup's CPU
// quota (cgroup.h, rounded up). At least 1.
int CpuQuota();

// Calls body(begin, end) on disjoint ranges that cover [0, count), on up to `threads` threads, the calling
// one included; returns when all are done. A range holds at least `grain` items, so a small loop costs no
// thread. What a body throws is thrown here once all are done: the first range's, where several do.
void ParallelFor(int64_t count, int threads, int64_t grain,
                 const std::function<void(int64_t, int64_t)>& body);

}  // namespace stance
