// What a server refuses, in the words of the command line.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace rilievo {

// The option that a path of the protocol belongs to: "--max-error" for
// "header.options.encode.max_error_ratio"; the last word of the path where there is none, empty for
// the points themselves.
std::string OptionOfField(absl::string_view field);

// The message of an error of a call or a job, each field at fault by its option and once.
std::string WordsOf(const absl::Status& status);

}  // namespace rilievo
