#include "server/trace_context.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace stance {
namespace {

constexpr char kTrace[] = "4bf92f3577b34da6a3ce929d0e0e4736";
constexpr char kSpan[] = "00f067aa0ba902b7";

std::string Header(const std::string& flags) {
  return std::string("00-") + std::string(kTrace) + "-" + kSpan + "-" + flags;
}

TEST(TraceContextTest, ReadsAHeader) {
  const auto caller = ParseTraceparent(Header("01"));
  ASSERT_TRUE(caller.has_value());
  EXPECT_EQ(caller->trace_id, kTrace);
  EXPECT_EQ(caller->span_id, kSpan);
  EXPECT_TRUE(caller->sampled);
}

TEST(TraceContextTest, OnlyTheLowestFlagMeansSampled) {
  for (int flags = 0; flags < 256; ++flags) {
    const char* digits = "0123456789abcdef";
    const auto caller = ParseTraceparent(Header({digits[flags >> 4], digits[flags & 15]}));
    ASSERT_TRUE(caller.has_value()) << flags;
    EXPECT_EQ(caller->sampled, (flags & 1) == 1) << flags;
  }
}

TEST(TraceContextTest, ALaterVersionIsReadAsThisOne) {
  for (const std::string& header : {std::string("01") + Header("01").substr(2),
                                    std::string("cc") + Header("01").substr(2) + "-what-the-future-brings"}) {
    const auto caller = ParseTraceparent(header);
    ASSERT_TRUE(caller.has_value()) << header;
    EXPECT_EQ(caller->trace_id, kTrace);
    EXPECT_EQ(FormatTraceparent(*caller), Header("01"));
  }
}

TEST(TraceContextTest, MalformedHeadersAreNone) {
  const std::string good = Header("01");
  std::string capital = good, zero_trace = good, zero_span = good;
  capital[4] = 'B';
  zero_trace.replace(3, 32, 32, '0');
  zero_span.replace(36, 16, 16, '0');
  for (const std::string& header :
       {std::string(), std::string("ff") + good.substr(2), std::string("0") + good.substr(2), good + "-",
        good + "0", std::string("01") + good.substr(2) + "x", good + "-00", " " + good, good + " ", capital,
        zero_trace, zero_span, std::string("0X") + good.substr(2)}) {
    EXPECT_FALSE(ParseTraceparent(header).has_value()) << header;
  }
}

// Of every header that differs from a good one in one character, those that are read say what they hold.
TEST(TraceContextTest, NoSingleChangeIsMisread) {
  const std::string good = Header("01");
  for (size_t at = 0; at < good.size(); ++at) {
    for (int c = 0; c < 256; ++c) {
      std::string header = good;
      header[at] = static_cast<char>(c);
      const auto caller = ParseTraceparent(header);
      const bool dash = at == 2 || at == 35 || at == 52;
      const bool hex = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
      ASSERT_EQ(caller.has_value(), dash ? c == '-' : hex) << header;
      if (caller) {
        EXPECT_EQ(caller->trace_id, header.substr(3, 32));
        EXPECT_EQ(caller->span_id, header.substr(36, 16));
      }
    }
    EXPECT_FALSE(ParseTraceparent(good.substr(0, at)).has_value()) << at;
  }
}

TEST(TraceContextTest, ASpanContinuesTheCallersTrace) {
  Random random(5);
  const auto caller = ParseTraceparent(Header("01"));
  const TraceContext span = BeginSpan(caller, random);
  EXPECT_EQ(span.trace_id, kTrace);
  EXPECT_EQ(span.parent_id, kSpan);
  EXPECT_NE(span.span_id, kSpan);
  EXPECT_TRUE(span.sampled);
  EXPECT_FALSE(BeginSpan(ParseTraceparent(Header("00")), random).sampled);
}

TEST(TraceContextTest, ANewTraceIsWellFormedAndItsOwn) {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) {
    const TraceContext span = BeginSpan(std::nullopt);
    EXPECT_EQ(span.parent_id, "");
    EXPECT_FALSE(span.sampled);
    EXPECT_TRUE(seen.insert(span.trace_id).second);
    EXPECT_TRUE(seen.insert(span.span_id).second);
    const auto read = ParseTraceparent(FormatTraceparent(span));
    ASSERT_TRUE(read.has_value()) << FormatTraceparent(span);
    EXPECT_EQ(read->trace_id, span.trace_id);
    EXPECT_EQ(read->span_id, span.span_id);
  }
}

}  // namespace
}  // namespace stance
