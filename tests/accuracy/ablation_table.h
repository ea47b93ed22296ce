// What each mechanism of the core earns: the scans measured once more without it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "tests/accuracy/accuracy_table.h"

namespace rilievo {

// Leaves one mechanism out of all that follows. INVALID_ARGUMENT for a name that none has, and
// FAILED_PRECONDITION in a build that can leave nothing out.
absl::Status LeaveOutByName(std::string_view name);

// Measures the subjects as they are and then without each of the mechanisms named (none named: each
// there is), means over so many seeds, one line to standard output as soon as it is known.
// Markdown.
absl::StatusOr<std::string> MeasureAblation(const std::vector<SubjectName>& subjects,
                                            const std::vector<std::string>& names, int seeds);

}  // namespace rilievo
