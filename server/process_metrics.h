// What every Prometheus client library tells of its process, under the usual names (process_...).
#pragma once

#include <prometheus/metric_family.h>

#include <filesystem>
#include <vector>

namespace stance {

// Memory, CPU time, start time and file descriptors of the process that `folder` (as /proc/self) describes,
// in bytes and seconds. What can't be read is left out.
std::vector<prometheus::MetricFamily> ProcessMetrics(const std::filesystem::path& folder = "/proc/self");

}  // namespace stance
