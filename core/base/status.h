// Helpers around absl::Status, the error type of every input, file and model path in Stance.
//
// A status text names the field and the offending value. Our own bugs are not statuses: see check.h.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define STANCE_STATUS_CONCAT_INNER(a, b) a##b
#define STANCE_STATUS_CONCAT(a, b) STANCE_STATUS_CONCAT_INNER(a, b)

// Returns from the enclosing function if `expr` (an absl::Status) is an error.
#define STANCE_RETURN_IF_ERROR(expr)                                                    \
  do {                                                                                  \
    if (absl::Status stance_status = (expr); !stance_status.ok()) return stance_status; \
  } while (false)

// Evaluates `expr` (an absl::StatusOr<T>); assigns its value to `lhs`, or returns its error.
#define STANCE_ASSIGN_OR_RETURN(lhs, expr) \
  STANCE_ASSIGN_OR_RETURN_IMPL(STANCE_STATUS_CONCAT(stance_or_, __LINE__), lhs, expr)
#define STANCE_ASSIGN_OR_RETURN_IMPL(result, lhs, expr) \
  auto result = (expr);                                 \
  if (!result.ok()) return result.status();             \
  lhs = std::move(result).value()
