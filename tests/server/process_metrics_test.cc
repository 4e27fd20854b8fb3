#include "server/process_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace stance {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

std::map<std::string, double> ValuesOf(const std::vector<prometheus::MetricFamily>& families) {
  std::map<std::string, double> values;
  for (const auto& family : families) {
    EXPECT_EQ(family.metric.size(), 1u) << family.name;
    EXPECT_FALSE(family.help.empty()) << family.name;
    const auto& metric = family.metric.front();
    values[family.name] =
        family.type == prometheus::MetricType::Counter ? metric.counter.value : metric.gauge.value;
  }
  return values;
}

TEST(ProcessMetricsTest, ReadsThisProcess) {
  const auto values = ValuesOf(ProcessMetrics());
  ASSERT_EQ(values.size(), 6u);
  EXPECT_GT(values.at("process_resident_memory_bytes"), 1e6);
  EXPECT_GT(values.at("process_virtual_memory_bytes"), values.at("process_resident_memory_bytes"));
  EXPECT_GE(values.at("process_open_fds"), 3);
  EXPECT_GE(values.at("process_max_fds"), values.at("process_open_fds"));
  const double now =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_LE(values.at("process_start_time_seconds"), now + 2);
  EXPECT_GT(values.at("process_start_time_seconds"), now - 86400);
}

TEST(ProcessMetricsTest, MoreMemoryIsSeen) {
  const double before = ValuesOf(ProcessMetrics()).at("process_resident_memory_bytes");
  const std::string block(size_t{64} << 20, 'x');
  EXPECT_GT(ValuesOf(ProcessMetrics()).at("process_resident_memory_bytes"), before + 5e7);
  EXPECT_EQ(block.back(), 'x');
}

// A program's name may hold spaces and parentheses.
TEST(ProcessMetricsTest, ReadsPastTheName) {
  const fs::path folder = fs::path(::testing::TempDir()) / "stance-process-metrics";
  fs::create_directories(folder / "fd");
  std::ofstream(folder / "fd" / "0");
  std::ofstream(folder / "fd" / "1");
  std::ofstream(folder / "stat") << "7 (a) (b 9) S 1 2 3 4 5 6 7 8 9 10 500 250 0 0 0 0 0 0 0 4096 3 0 0\n";
  std::ofstream(folder / "limits") << "Limit Soft Hard\nMax open files            1024  4096 files\n";
  const auto values = ValuesOf(ProcessMetrics(folder));
  EXPECT_EQ(values.at("process_cpu_seconds_total"), 750.0 / static_cast<double>(sysconf(_SC_CLK_TCK)));
  EXPECT_EQ(values.at("process_virtual_memory_bytes"), 4096);
  EXPECT_EQ(values.at("process_resident_memory_bytes"), 3.0 * static_cast<double>(sysconf(_SC_PAGESIZE)));
  EXPECT_EQ(values.at("process_open_fds"), 2);
  EXPECT_EQ(values.at("process_max_fds"), 1024);
  fs::remove_all(folder);
}

TEST(ProcessMetricsTest, WhatIsNotThereIsLeftOut) { EXPECT_THAT(ProcessMetrics("/nonexistent"), IsEmpty()); }

}  // namespace
}  // namespace stance
