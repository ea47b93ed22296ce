// How the program ends, and why.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace rilievo {

// Documented in --help; scripts rely on the numbers.
enum class ExitCode {
  kOk = 0,
  kInternal = 1,   // a defect of the program or the server
  kUsage = 2,      // the command line
  kInput = 3,      // a file that cannot be read, or a scan that cannot become a surface
  kServer = 4,     // the server cannot be reached, is full, or ran out of time
  kCancelled = 5,  // by Ctrl-C or SIGTERM
  kOutput = 6,     // the result, or a scratch folder, cannot be written
  kDiffers = 7,    // a certificate that is not confirmed, or a bound of compare exceeded
};

// The table above for --help.
extern const char kExitCodeHelp[];

// Attaches an exit code that the status code alone would not give. OK stays OK.
absl::Status WithExitCode(absl::Status status, ExitCode code);

// The same status, exit code and all, in other words.
absl::Status WithMessage(const absl::Status& status, const std::string& message);

// The same, of the file (or the operation) `path`: that and a colon before its message.
absl::Status AtPath(const std::string& path, const absl::Status& status);

// INVALID_ARGUMENT with kUsage.
absl::Status UsageError(const std::string& message);

// The attached code, or the one that fits the status code.
ExitCode ExitCodeOf(const absl::Status& status);

}  // namespace rilievo
