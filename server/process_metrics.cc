#include "server/process_metrics.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>

namespace stance {
namespace {

using prometheus::MetricType;

void Add(std::vector<prometheus::MetricFamily>& families, MetricType type, const char* name, const char* help,
         double value) {
  prometheus::ClientMetric metric;
  if (type == MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  families.push_back({name, help, type, {metric}});
}

// The time at which the machine started, seconds since 1970; 0 if it is not known.
double BootTime() {
  std::ifstream stream("/proc/stat");
  std::string key;
  for (double value = 0; stream >> key; stream.ignore(1 << 20, '\n')) {
    if (key == "btime" && stream >> value) return value;
  }
  return 0;
}

// The soft limit of open files; 0 if there is none.
double MaxOpenFiles(const std::filesystem::path& limits) {
  std::ifstream stream(limits);
  const std::string name = "Max open files";
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(name)) continue;
    double limit = 0;
    std::istringstream(line.substr(name.size())) >> limit;
    return limit;
  }
  return 0;
}

}  // namespace

std::vector<prometheus::MetricFamily> ProcessMetrics(const std::filesystem::path& folder) {
  std::vector<prometheus::MetricFamily> families;
  std::ifstream stream(folder / "stat");
  const std::string stat((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  // proc(5): the second field, the program's name in parentheses, may hold anything; the third follows it.
  const size_t name_end = stat.rfind(") ");
  if (name_end != std::string::npos) {
    std::istringstream fields(stat.substr(name_end + 2));
    std::vector<std::string> words{std::istream_iterator<std::string>(fields), {}};
    const auto field = [&](size_t number) { return std::atof(words[number - 3].c_str()); };
    const auto ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
    if (words.size() >= 22) {
      Add(families, MetricType::Counter, "process_cpu_seconds_total",
          "User and system CPU time of the process, seconds", (field(14) + field(15)) / ticks);
      Add(families, MetricType::Gauge, "process_start_time_seconds",
          "Start time of the process, seconds since 1970", BootTime() + field(22) / ticks);
      Add(families, MetricType::Gauge, "process_virtual_memory_bytes", "Virtual memory of the process, bytes",
          field(23));
      Add(families, MetricType::Gauge, "process_resident_memory_bytes",
          "Resident memory of the process, bytes", field(24) * static_cast<double>(sysconf(_SC_PAGESIZE)));
    }
  }
  std::error_code error;
  double open = 0;
  for (std::filesystem::directory_iterator it(folder / "fd", error), end; !error && it != end;
       it.increment(error)) {
    ++open;
  }
  if (!error) {
    Add(families, MetricType::Gauge, "process_open_fds", "Open file descriptors of the process", open);
  }
  if (const double most = MaxOpenFiles(folder / "limits"); most > 0) {
    Add(families, MetricType::Gauge, "process_max_fds", "Most open file descriptors of the process", most);
  }
  return families;
}

}  // namespace stance
