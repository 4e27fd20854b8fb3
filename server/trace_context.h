// Whose work a request is part of: W3C Trace Context (Recommendation of 23 November 2021), header
// traceparent.
#pragma once

#include <optional>
#include <string>

#include "core/base/random.h"

namespace stance {

// One span of a trace. Ids are lower-case hexadecimal and not all zero.
struct TraceContext {
  std::string trace_id;   // 32 digits
  std::string span_id;    // 16 digits
  std::string parent_id;  // 16 digits: the caller's span; empty where the trace begins here
  bool sampled = false;   // whether the caller may have recorded it
};

// The caller's span from its header: nothing for one that is malformed, or of the forbidden version ff. Of a
// version after 00 what 00 knows is read.
std::optional<TraceContext> ParseTraceparent(const std::string& header);

// "00-TRACE-SPAN-FLAGS".
std::string FormatTraceparent(const TraceContext& span);

// A new span: a child of the caller's, or the first of a new trace that nobody has recorded.
TraceContext BeginSpan(const std::optional<TraceContext>& caller, Random& random);

// The same with random numbers of this process. Thread-safe.
TraceContext BeginSpan(const std::optional<TraceContext>& caller);

}  // namespace stance
