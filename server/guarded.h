// Exceptions on the worker threads, turned into statuses.
#pragma once

#include <fmt/format.h>

#include <exception>
#include <new>

#include "server/status_map.h"

namespace stance {

// What `work` returns (a status), or a status for what it throws: RESOURCE_EXHAUSTED with the reason
// OUT_OF_MEMORY for std::bad_alloc, INTERNAL for any other exception. Core turns its libraries' exceptions
// into statuses itself; what is left must cost its caller the answer and not the process its life. `what`
// says in the text what failed: "reading the request".
template <typename Work>
absl::Status Guarded(const char* what, Work&& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return WithReason(absl::ResourceExhaustedError(fmt::format("{}: the server is out of memory", what)),
                      "OUT_OF_MEMORY");
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("{}: {}", what, error.what()));
  }
}

}  // namespace stance
