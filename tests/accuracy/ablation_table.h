// What each mechanism and each setting of the core earns: the scans measured once more without it,
// or with another value.
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

// Changes one setting for all that follows. INVALID_ARGUMENT for a name that none has, and
// FAILED_PRECONDITION in a build that can change nothing.
absl::Status SetByName(std::string_view name, double value);

// The same table for settings: each whose name begins with one of `names` (none named: each there
// is), with less and with more of it, see OtherValues().
absl::StatusOr<std::string> MeasureSensitivity(const std::vector<SubjectName>& subjects,
                                               const std::vector<std::string>& names, int seeds);

// The values at which a setting is tried: 0.7 and 1.4 of it, or of what it lacks to 1 where it lies
// in (0.5, 1), as cosines and shares do; counts differ by 1 at least.
std::vector<double> OtherValues(double value, bool whole);

}  // namespace rilievo
