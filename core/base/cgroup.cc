#include "core/base/cgroup.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

namespace stance {
namespace {

std::optional<double> QuotaOf(const std::filesystem::path& group) {
  double quota = 0, period = 0;
  if (std::ifstream v2(group / "cpu.max"); v2 >> quota >> period) {  // fails on "max"
    if (quota > 0 && period > 0) return quota / period;
  }
  std::ifstream quota_file(group / "cpu.cfs_quota_us"), period_file(group / "cpu.cfs_period_us");
  if (quota_file >> quota && period_file >> period && quota > 0 && period > 0) return quota / period;
  return std::nullopt;
}

// The smallest quota of `hierarchy` + `group` and of the folders above it, the hierarchy's own included:
// within a container the group's path may be the host's, and only the topmost folder is there.
void LowerToQuotas(const std::filesystem::path& hierarchy, std::string group, std::optional<double>& cpus) {
  while (true) {
    if (const auto quota = QuotaOf(hierarchy.string() + group))
      cpus = std::min(cpus.value_or(*quota), *quota);
    if (group.empty() || group == "/") return;
    group.resize(group.rfind('/'));
  }
}

bool HasCpu(const std::string& controllers) {
  std::istringstream list(controllers);
  for (std::string controller; std::getline(list, controller, ',');) {
    if (controller == "cpu") return true;
  }
  return false;
}

}  // namespace

std::optional<double> CgroupCpus(const std::filesystem::path& membership, const std::filesystem::path& root) {
  std::optional<double> cpus;
  std::ifstream lines(membership);
  for (std::string line; std::getline(lines, line);) {  // "0::/group" or "4:cpu,cpuacct:/group"
    const size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1),
                      group = line.substr(second + 1);
    if (!group.starts_with('/')) continue;
    if (controllers.empty()) {
      LowerToQuotas(root, group, cpus);
    } else if (HasCpu(controllers)) {
      LowerToQuotas(root / "cpu", group, cpus);
    }
  }
  return cpus;
}

}  // namespace stance
