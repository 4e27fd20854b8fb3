#include "server/trace_context.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <random>

namespace stance {
namespace {

// version "-" trace-id "-" parent-id "-" trace-flags (section 3.2).
constexpr size_t kTraceAt = 3, kTraceSize = 32;
constexpr size_t kSpanAt = 36, kSpanSize = 16;
constexpr size_t kFlagsAt = 53, kFlagsSize = 2;
constexpr size_t kSize = 55;

bool IsHex(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool IsId(const std::string& text) { return IsHex(text) && text.find_first_not_of('0') != std::string::npos; }

// Not all zero: that means "none".
uint64_t NextId(Random& random) {
  uint64_t id = 0;
  while (id == 0) id = random.Next();
  return id;
}

uint64_t Seed() {
  std::random_device device;
  return (uint64_t{device()} << 32) | device();
}

}  // namespace

std::optional<TraceContext> ParseTraceparent(const std::string& header) {
  if (header.size() < kSize) return std::nullopt;
  const std::string version = header.substr(0, 2);
  if (!IsHex(version) || version == "ff") return std::nullopt;
  // Version 00 has nothing behind its flags; a later one may, after a dash.
  if (header.size() > kSize && (version == "00" || header[kSize] != '-')) return std::nullopt;
  for (const size_t dash : {kTraceAt - 1, kSpanAt - 1, kFlagsAt - 1}) {
    if (header[dash] != '-') return std::nullopt;
  }
  TraceContext caller;
  caller.trace_id = header.substr(kTraceAt, kTraceSize);
  caller.span_id = header.substr(kSpanAt, kSpanSize);
  const std::string flags = header.substr(kFlagsAt, kFlagsSize);
  if (!IsId(caller.trace_id) || !IsId(caller.span_id) || !IsHex(flags)) return std::nullopt;
  caller.sampled = std::string("13579bdf").find(flags[1]) != std::string::npos;  // bit 0
  return caller;
}

std::string FormatTraceparent(const TraceContext& span) {
  // Flags that version 00 does not know are to be zero.
  return fmt::format("00-{}-{}-{}", span.trace_id, span.span_id, span.sampled ? "01" : "00");
}

TraceContext BeginSpan(const std::optional<TraceContext>& caller, Random& random) {
  TraceContext span;
  span.span_id = fmt::format("{:016x}", NextId(random));
  if (caller) {
    span.trace_id = caller->trace_id;
    span.parent_id = caller->span_id;
    span.sampled = caller->sampled;
  } else {
    const uint64_t high = NextId(random);
    span.trace_id = fmt::format("{:016x}{:016x}", high, random.Next());
  }
  return span;
}

TraceContext BeginSpan(const std::optional<TraceContext>& caller) {
  static std::mutex mutex;
  static Random random(Seed());
  std::lock_guard<std::mutex> guard(mutex);
  return BeginSpan(caller, random);
}

}  // namespace stance
