// Early return for absl::Status and absl::StatusOr, the only error channel of core.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define RILIEVO_CONCAT_INNER(a, b) a##b
#define RILIEVO_CONCAT(a, b) RILIEVO_CONCAT_INNER(a, b)

// Returns from the enclosing function when `expression` is not OK.
#define RILIEVO_RETURN_IF_ERROR(expression)                                 \
  do {                                                                      \
    if (absl::Status rilievo_status = (expression); !rilievo_status.ok()) { \
      return rilievo_status;                                                \
    }                                                                       \
  } while (false)

// Evaluates a StatusOr; returns its status when not OK, else moves the value into `target`.
#define RILIEVO_ASSIGN_OR_RETURN(target, expression) \
  RILIEVO_ASSIGN_OR_RETURN_IMPL(RILIEVO_CONCAT(rilievo_status_or_, __LINE__), target, expression)

#define RILIEVO_ASSIGN_OR_RETURN_IMPL(status_or, target, expression) \
  auto status_or = (expression);                                     \
  if (!status_or.ok()) return std::move(status_or).status();         \
  target = *std::move(status_or)
