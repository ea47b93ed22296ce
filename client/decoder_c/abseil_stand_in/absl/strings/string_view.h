// absl::string_view, which is std's; see absl/status/status.h.
#pragma once

#include "absl/status/status.h"
