#include "core/training/gzip.h"

#include <gtest/gtest.h>

#include "core/base/files.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

TEST(Gzip, RoundTrip) {
  std::string text;
  for (uint32_t i = 0; i < 65536; ++i) text += static_cast<char>(i * i % 251);
  for (const std::string& bytes : {std::string(), std::string("a"), text}) {
    const auto content = Decompress(Compress(bytes), bytes.size());
    ASSERT_TRUE(content.ok()) << content.status();
    EXPECT_EQ(*content, bytes);
  }
}

TEST(Gzip, ReadsGzipFiles) {
  const testing::TemporaryFolder folder;
  testing::WriteGzip(folder.path() / "file.gz", "some text\n");
  EXPECT_EQ(*Decompress(*ReadFile(folder.path() / "file.gz"), 100), "some text\n");
}

TEST(Gzip, RejectsDamageAndBombs) {
  const std::string compressed = Compress(std::string(1 << 20, 'x'));
  EXPECT_EQ(Decompress(compressed, 1000).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(Decompress(compressed.substr(0, compressed.size() - 3), 1 << 20).status().code(),
            absl::StatusCode::kDataLoss);
  EXPECT_EQ(Decompress("not compressed", 1000).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(Decompress("", 1000).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace stance
