// Where a command's result goes: a file, a file in a folder, or the standard output.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

inline bool IsStandardOutput(const std::string& path) { return path == "-"; }

// Asked before long work: OK when something could be written there. Empty paths are passed over. An
// error has the exit code kOutput; kUsage when `bytes` would go to a terminal, or when two of the
// outputs are the standard output. `text`: outputs that people can read.
absl::Status CheckOutputs(const std::vector<std::string>& bytes,
                          const std::vector<std::string>& text = {});

// The standard input can be read once: kUsage when two of `inputs` are "-".
absl::Status CheckInputs(const std::vector<std::string>& inputs);

// What is said to people: the standard output, unless a result goes there.
std::ostream& WordsBeside(const std::string& output);

// Writes all of `text` to `path` (see WriteFileAtomically); an error has the exit code kOutput.
absl::Status WriteText(const std::string& path, const std::string& text);

// The surface of each scan. One scan: `output` itself, unless that is a folder (it exists, or ends
// with '/'); several: files in the folder `output`, which is made, named as the scans with the
// extension .dss. Errors with kUsage: two scans of one name, several scans and no folder, more than
// one of them the standard input.
absl::StatusOr<std::vector<std::string>> SurfacePaths(const std::vector<std::string>& scans,
                                                      const std::string& output);

}  // namespace rilievo
