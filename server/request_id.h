// The names of requests in answers and logs.
#pragma once

#include <string>

#include "core/base/status.h"

namespace stance {

// A random UUID4. Thread-safe.
std::string MakeRequestId();

// The caller's own id, or a new one if it is empty. INVALID_ARGUMENT for more than 64 characters or one that
// is not printable ASCII.
absl::StatusOr<std::string> ChooseRequestId(const std::string& requested);

}  // namespace stance
