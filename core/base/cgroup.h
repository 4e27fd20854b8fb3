// The CPU time that the control group allows.
#pragma once

#include <filesystem>
#include <optional>

namespace stance {

// The CPUs that the quota of the process's control group and of each group above it leaves, none where there
// is no quota. Reads `membership` (the process's own is /proc/self/cgroup) and the groups' files below `root`
// (/sys/fs/cgroup): cpu.max of version 2, cpu.cfs_quota_us and cpu.cfs_period_us of version 1. What can't be
// read sets no quota.
std::optional<double> CgroupCpus(const std::filesystem::path& membership = "/proc/self/cgroup",
                                 const std::filesystem::path& root = "/sys/fs/cgroup");

}  // namespace stance
