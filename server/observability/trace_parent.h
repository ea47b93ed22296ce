// Which trace a call is part of (W3C Trace Context, the header "traceparent").
#pragma once

#include <optional>
#include <string>

#include "absl/strings/string_view.h"

namespace rilievo {

struct TraceParent {
  std::string trace_id;   // 32 hexadecimal digits, not all 0
  std::string parent_id;  // 16, of the caller's span
};

// Nothing when `header` is not one: the trace then begins nowhere, and the call goes on all the
// same.
std::optional<TraceParent> ParseTraceParent(absl::string_view header);

}  // namespace rilievo
