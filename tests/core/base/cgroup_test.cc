#include "core/base/cgroup.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace stance {
namespace {

class CgroupTest : public ::testing::Test {
 protected:
  ~CgroupTest() override { std::filesystem::remove_all(folder_); }

  void Write(const std::string& file, const std::string& text) {
    const auto path = folder_ / file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  std::optional<double> Cpus() const { return CgroupCpus(folder_ / "membership", folder_ / "fs"); }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) / ("cgroup" + std::to_string(getpid()));
};

TEST_F(CgroupTest, NoGroupNoQuota) {
  EXPECT_EQ(Cpus(), std::nullopt);
  Write("membership", "0::/\n");
  EXPECT_EQ(Cpus(), std::nullopt);
  Write("fs/cpu.max", "max 100000\n");
  EXPECT_EQ(Cpus(), std::nullopt);
}

TEST_F(CgroupTest, AContainersOwnQuota) {
  Write("membership", "0::/\n");
  Write("fs/cpu.max", "150000 100000\n");
  EXPECT_EQ(Cpus(), 1.5);
}

TEST_F(CgroupTest, TheSmallestOfTheGroupAndThoseAbove) {
  Write("membership", "0::/system.slice/stance.service\n");
  Write("fs/cpu.max", "800000 100000\n");
  Write("fs/system.slice/stance.service/cpu.max", "400000 100000\n");
  EXPECT_EQ(Cpus(), 4);
  Write("fs/system.slice/cpu.max", "200000 100000\n");
  EXPECT_EQ(Cpus(), 2);
}

TEST_F(CgroupTest, AContainerThatSeesTheHostsPath) {
  Write("membership", "0::/kubepods/pod1\n");
  Write("fs/cpu.max", "300000 100000\n");
  EXPECT_EQ(Cpus(), 3);
}

TEST_F(CgroupTest, VersionOne) {
  Write("membership", "7:cpuset:/x\n4:cpu,cpuacct:/job\nmalformed\n5:cpu:relative\n");
  Write("fs/cpu/job/cpu.cfs_quota_us", "50000\n");
  Write("fs/cpu/job/cpu.cfs_period_us", "100000\n");
  Write("fs/cpu/cpu.cfs_quota_us", "-1\n");
  Write("fs/cpu/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(Cpus(), 0.5);
}

}  // namespace
}  // namespace stance
