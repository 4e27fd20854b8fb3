#include "core/transfer/options.h"

#include <gtest/gtest.h>

#include <cmath>

namespace stance {
namespace {

TEST(Method, NamesRoundTrip) {
  for (const Method method : {Method::kSkeletal, Method::kStance, Method::kNeural}) {
    EXPECT_EQ(*MethodFromName(MethodName(method)), method);
  }
  EXPECT_EQ(MethodFromName("telepathic").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(CheckOptions, NamesTheFieldAndTheValue) {
  const auto refused = [](auto spoil) {
    TransferOptions options;
    spoil(options);
    const absl::Status status = CheckOptions(options);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_TRUE(CheckOptions({}).ok());
  EXPECT_TRUE(refused([](auto& o) { o.smoothing.length = -1; }).starts_with("smoothing.length: -1 "));
  EXPECT_TRUE(
      refused([](auto& o) { o.smoothing.length = std::nan(""); }).starts_with("smoothing.length: nan"));
  EXPECT_TRUE(refused([](auto& o) {
                o.smoothing.kind = SmoothingKind::kHopwise;
                o.smoothing.lambda = 0;
              }).starts_with("smoothing.lambda: 0 "));
  EXPECT_TRUE(refused([](auto& o) { o.max_influences = 25; }).starts_with("max_influences: 25 "));
}

}  // namespace
}  // namespace stance
